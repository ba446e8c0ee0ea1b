#include "frontend/vision/picture_appearance.h"

#include "frontend/vision/appearance.h"
#include "frontend/vision/corners.h"
#include "frontend/vision/pyramid.h"
#include "frontend/vision/spread.h"

namespace relmap::vision {
namespace {

constexpr int kCornersOnLevelZero = 80;  // half as many on each level above: 150 in all, a keyframe's tracks
constexpr float kFeaturesApart = 5;      // pixels of the level
constexpr int kThresholdRounds = 5;      // until the detector's thresholds have adapted to the picture

}  // namespace

std::vector<AppearanceFeature> picture_appearance(ImageView grey) {
  if (grey.empty()) return {};
  const Pyramid pyramid(grey);
  CornerDetector detector;
  auto corners = detector.detect(pyramid);
  for (int round = 1; round < kThresholdRounds; ++round) corners = detector.detect(pyramid);

  std::vector<TrackedPosition> positions;
  for (int level = 0; level < pyramid.levels(); ++level) {
    const ImageView image = pyramid.level(level);
    const auto& candidates = corners[static_cast<std::size_t>(level)];
    for (const std::uint32_t i :
         choose_spread(candidates, {}, image.width, image.height, kCornersOnLevelZero >> level, kFeaturesApart))
      positions.push_back({from_level(candidates[i].x, level), from_level(candidates[i].y, level), level, -1});
  }
  return detect_appearance(grey, positions);
}

}  // namespace relmap::vision
