#include "frontend/tracking/pair.h"

#include <utility>

#include "frontend/vision/exposure.h"

namespace relmap {

Pyramid prepare_eye(ImageView picture) {
  const Exposure exposure = measure_exposure(picture);
  if (exposure.blind()) return {};
  return Pyramid(standardise(picture, exposure));
}

std::shared_ptr<const Pair> prepare_pair(Image left, ImageView right) {
  auto pair = std::make_shared<Pair>();
  pair->left = prepare_eye(left);
  pair->right = prepare_eye(right);
  pair->picture = std::move(left);
  return pair;
}

}  // namespace relmap
