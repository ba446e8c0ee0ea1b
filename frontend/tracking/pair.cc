#include "frontend/tracking/pair.h"

#include <utility>

#include "frontend/vision/exposure.h"

namespace relmap::tracking {

vision::Pyramid prepare_eye(vision::ImageView picture) {
  const vision::Exposure exposure = vision::measure_exposure(picture);
  if (exposure.blind()) return {};
  return vision::Pyramid(vision::standardise(picture, exposure));
}

std::shared_ptr<const Pair> prepare_pair(vision::Image left, vision::ImageView right) {
  auto pair = std::make_shared<Pair>();
  pair->left = prepare_eye(left);
  pair->right = prepare_eye(right);
  pair->picture = std::move(left);
  return pair;
}

}  // namespace relmap::tracking
