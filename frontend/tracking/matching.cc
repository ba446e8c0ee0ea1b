#include "frontend/tracking/matching.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "frontend/vision/stereo_match.h"

namespace relmap {

namespace {

constexpr double kNearest = 0.2;               // metres
constexpr int kCoarseSad = 16 * kPatchPixels;  // at most 16 grey levels a pixel
constexpr float kCoarseRatio = 0.85F;
constexpr int kFineSearch = 2;  // pixels of the level
constexpr float kLeastCorrelation = 0.8F;

struct Prediction {
  StereoPixel pixel;
  std::optional<Template> patch;
};

// Where and how a landmark should look; no patch if it should not be seen.
Prediction predict(const Landmark& landmark, const SE3& T_camera_keyframe, const StereoCamera& camera) {
  Prediction prediction;
  const Vector3 p = T_camera_keyframe * landmark.point;
  if (!(p.z() > kNearest)) return prediction;
  prediction.pixel = camera.project(p);
  if (!camera.in_picture(prediction.pixel.x(), prediction.pixel.y())) return prediction;
  prediction.patch = Template::from_anchor(landmark.anchor, landmark.warp(T_camera_keyframe));
  return prediction;
}

}  // namespace

std::vector<Sighting> match_corners(std::span<const Landmark> landmarks, const SE3& T_camera_keyframe,
                                    const StereoCamera& camera, const Pair& pair, double radius) {
  std::vector<Sighting> sightings;
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    const int level = landmarks[i].level;
    if (level >= pair.left.levels()) continue;
    const Prediction prediction = predict(landmarks[i], T_camera_keyframe, camera);
    if (!prediction.patch) continue;
    const ImageView image = pair.left.level(level);
    const SadPatch patch = prediction.patch->sad();
    const float x = to_level(static_cast<float>(prediction.pixel.x()), level);
    const float y = to_level(static_cast<float>(prediction.pixel.y()), level);
    const float reach = std::max(3.0F, static_cast<float>(radius) / static_cast<float>(1 << level));
    const auto& corners = pair.corners[static_cast<std::size_t>(level)];
    auto corner = std::lower_bound(corners.begin(), corners.end(), y - reach,
                                   [](const Corner& c, float row) { return static_cast<float>(c.y) < row; });
    int best = std::numeric_limits<int>::max(), second = best;
    const Corner* found = nullptr;
    for (; corner != corners.end() && static_cast<float>(corner->y) <= y + reach; ++corner) {
      if (std::abs(static_cast<float>(corner->x) - x) > reach || !patch_fits(image, corner->x, corner->y)) continue;
      const int sad = patch.compare(image, corner->x, corner->y);
      if (sad < best) {
        // A neighbouring pixel is no rival.
        if (!found || std::abs(found->x - corner->x) > 2 || std::abs(found->y - corner->y) > 2) second = best;
        best = sad;
        found = &*corner;
      } else if (found && (std::abs(found->x - corner->x) > 2 || std::abs(found->y - corner->y) > 2)) {
        second = std::min(second, sad);
      }
    }
    if (!found || best > kCoarseSad || static_cast<float>(best) > kCoarseRatio * static_cast<float>(second)) continue;
    sightings.push_back({i, {from_level(found->x, level), from_level(found->y, level), kNoRight}});
  }
  return sightings;
}

std::vector<Sighting> match_patches(std::span<const Landmark> landmarks, const SE3& T_camera_keyframe,
                                    const StereoCamera& camera, const Pair& pair, std::size_t& expected) {
  std::vector<Sighting> sightings;
  expected = 0;
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    const int level = landmarks[i].level;
    if (level >= pair.left.levels()) continue;
    const Prediction prediction = predict(landmarks[i], T_camera_keyframe, camera);
    if (!prediction.patch) continue;
    const ImageView image = pair.left.level(level);
    const int x = static_cast<int>(std::lround(to_level(static_cast<float>(prediction.pixel.x()), level)));
    const int y = static_cast<int>(std::lround(to_level(static_cast<float>(prediction.pixel.y()), level)));
    const SadPatch patch = prediction.patch->sad();
    int best = std::numeric_limits<int>::max(), best_x = 0, best_y = 0;
    for (int dy = -kFineSearch; dy <= kFineSearch; ++dy)
      for (int dx = -kFineSearch; dx <= kFineSearch; ++dx) {
        if (!patch_fits(image, x + dx, y + dy)) continue;
        const int sad = patch.compare(image, x + dx, y + dy);
        if (sad < best) {
          best = sad;
          best_x = x + dx;
          best_y = y + dy;
        }
      }
    if (best == std::numeric_limits<int>::max()) continue;
    ++expected;
    const auto aligned = prediction.patch->align(image, static_cast<float>(best_x), static_cast<float>(best_y));
    if (!aligned || aligned->correlation < kLeastCorrelation) continue;
    const float u = from_level(aligned->x, level), v = from_level(aligned->y, level);
    if (!camera.in_picture(u, v)) continue;
    const auto disparity = static_cast<float>(prediction.pixel.x() - prediction.pixel.z());
    const auto right = refine_stereo(pair.left, pair.right, u, v, level, disparity);
    sightings.push_back({i, {u, v, right ? static_cast<double>(u - right->disparity) : kNoRight}});
  }
  return sightings;
}

}  // namespace relmap
