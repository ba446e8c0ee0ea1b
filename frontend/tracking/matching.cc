#include "frontend/tracking/matching.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/vision/stereo_match.h"

namespace relmap::tracking {

namespace {

constexpr double kMinViewDepth = 0.2;                  // metres
constexpr int kCoarseSad = 20 * vision::kPatchPixels;  // at most 20 grey levels a pixel
constexpr float kCornerRatio = 0.85F;
constexpr std::size_t kEnoughSightings = 48;  // for a pose from which the fine search starts
constexpr int kMaxWindow = 10;                // pixels of the level, either way
constexpr int kFineSearch = 2;                // pixels of the level, either way
constexpr float kMinPatchCorrelation = 0.8F;

struct Place {
  float x = 0, y = 0;  // pixels of the level
};
std::optional<Place> place_of(const Landmark& landmark, int level, const SE3& T_eye_keyframe,
                              const StereoCamera& camera) {
  const Vector3 p = T_eye_keyframe * landmark.point;
  if (!(p.z() > kMinViewDepth)) return std::nullopt;
  const StereoPixel pixel = camera.project(p);
  if (!camera.in_picture(pixel.x(), pixel.y())) return std::nullopt;
  return Place{vision::to_level(static_cast<float>(pixel.x()), level),
               vision::to_level(static_cast<float>(pixel.y()), level)};
}

struct Best {
  int x = 0, y = 0;
  int sad = std::numeric_limits<int>::max();
};
Best search_window(const vision::SadPatch& patch, vision::ImageView image, int x, int y, int reach) {
  Best best;
  const int x0 = std::max(x - reach, vision::kPatchRadius),
            x1 = std::min(x + reach, image.width - vision::kPatchRadius - 1);
  const int y0 = std::max(y - reach, vision::kPatchRadius),
            y1 = std::min(y + reach, image.height - vision::kPatchRadius - 1);
  for (int row = y0; row <= y1; ++row)
    for (int column = x0; column <= x1; ++column) {
      const int sad = patch.compare(image, column, row);
      if (sad < best.sad) best = {column, row, sad};
    }
  return best;
}

// Searches every other pixel, then the neighbours of the best one: the difference already falls within two pixels of
// the right place.
Best search_coarsely(const vision::SadPatch& patch, vision::ImageView image, int x, int y, int reach) {
  Best best;
  const int x0 = std::max(x - reach, vision::kPatchRadius),
            x1 = std::min(x + reach, image.width - vision::kPatchRadius - 1);
  const int y0 = std::max(y - reach, vision::kPatchRadius),
            y1 = std::min(y + reach, image.height - vision::kPatchRadius - 1);
  for (int row = y0; row <= y1; row += 2)
    for (int column = x0 + (row - y0) / 2 % 2; column <= x1; column += 2) {
      const int sad = patch.compare(image, column, row);
      if (sad < best.sad) best = {column, row, sad};
    }
  return best.sad == std::numeric_limits<int>::max() ? best : search_window(patch, image, best.x, best.y, 1);
}

Sighting coarse_sighting(const ExpectedPatches::Patch& patch, const Best& best) {
  return {patch.landmark,
          {vision::from_level(static_cast<float>(best.x), patch.level),
           vision::from_level(static_cast<float>(best.y), patch.level), kNoRight},
          static_cast<float>(best.sad) / vision::kPatchPixels};
}

}  // namespace

ExpectedPatches::ExpectedPatches(std::span<const Landmark> landmarks, const SE3& T_eye_keyframe,
                                 const StereoCamera& camera, int levels)
    : landmarks_(landmarks) {
  patches_.reserve(landmarks.size());
  for (int level = levels - 1; level >= 0; --level)
    for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
      const Landmark& landmark = landmarks[i];
      if (landmark.level != level || !place_of(landmark, level, T_eye_keyframe, camera)) continue;
      if (const auto fine = vision::Template::from_anchor(landmark.anchor, landmark.warp(T_eye_keyframe)))
        patches_.push_back({i, level, *fine, fine->sad()});
    }
}

std::vector<Sighting> search_around(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                    const StereoCamera& camera, const vision::Pyramid& eye, double radius) {
  std::vector<Sighting> sightings;
  for (const auto& patch : expected.patches()) {
    if (sightings.size() >= kEnoughSightings) break;
    const int reach = std::max(kFineSearch, static_cast<int>(std::ceil(radius / (1 << patch.level))));
    if (reach > kMaxWindow) continue;
    const auto place = place_of(expected.landmarks()[patch.landmark], patch.level, T_eye_keyframe, camera);
    if (!place) continue;
    const Best best = search_coarsely(patch.coarse, eye.level(patch.level), static_cast<int>(std::lround(place->x)),
                                      static_cast<int>(std::lround(place->y)), reach);
    if (best.sad <= kCoarseSad) sightings.push_back(coarse_sighting(patch, best));
  }
  return sightings;
}

std::vector<Sighting> search_corners(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                     const StereoCamera& camera, const vision::Pyramid& eye,
                                     const std::vector<std::vector<vision::Corner>>& all_corners, double radius) {
  std::vector<Sighting> sightings;
  for (const auto& patch : expected.patches()) {
    const auto place = place_of(expected.landmarks()[patch.landmark], patch.level, T_eye_keyframe, camera);
    if (!place) continue;
    const vision::ImageView image = eye.level(patch.level);
    const float reach = std::max(3.0F, static_cast<float>(radius) / static_cast<float>(1 << patch.level));
    const auto& corners = all_corners[static_cast<std::size_t>(patch.level)];
    auto corner = std::lower_bound(corners.begin(), corners.end(), place->y - reach,
                                   [](const vision::Corner& c, float row) { return static_cast<float>(c.y) < row; });
    Best best;
    int second = best.sad;
    for (; corner != corners.end() && static_cast<float>(corner->y) <= place->y + reach; ++corner) {
      if (std::abs(static_cast<float>(corner->x) - place->x) > reach ||
          !vision::patch_fits(image, corner->x, corner->y))
        continue;
      const int sad = patch.coarse.compare(image, corner->x, corner->y);
      // A neighbour of the best pixel does not count as second best.
      const bool apart = std::abs(best.x - corner->x) > 2 || std::abs(best.y - corner->y) > 2;
      if (sad < best.sad) {
        if (apart) second = best.sad;
        best = {corner->x, corner->y, sad};
      } else if (apart) {
        second = std::min(second, sad);
      }
    }
    if (best.sad <= kCoarseSad && static_cast<float>(best.sad) <= kCornerRatio * static_cast<float>(second))
      sightings.push_back(coarse_sighting(patch, best));
  }
  return sightings;
}

std::vector<Sighting> align_patches(const ExpectedPatches& expected, const SE3& T_eye_keyframe,
                                    const StereoCamera& camera, const vision::Pyramid& eye, std::size_t& in_view) {
  std::vector<Sighting> sightings;
  in_view = 0;
  for (const auto& patch : expected.patches()) {
    const auto place = place_of(expected.landmarks()[patch.landmark], patch.level, T_eye_keyframe, camera);
    if (!place) continue;
    const vision::ImageView image = eye.level(patch.level);
    const Best best = search_window(patch.coarse, image, static_cast<int>(std::lround(place->x)),
                                    static_cast<int>(std::lround(place->y)), kFineSearch);
    if (best.sad == std::numeric_limits<int>::max()) continue;
    ++in_view;
    const auto aligned = patch.fine.align(image, static_cast<float>(best.x), static_cast<float>(best.y));
    if (!aligned || aligned->correlation < kMinPatchCorrelation) continue;
    const float u = vision::from_level(aligned->x, patch.level), v = vision::from_level(aligned->y, patch.level);
    if (camera.in_picture(u, v)) sightings.push_back({patch.landmark, {u, v, kNoRight}, aligned->error});
  }
  return sightings;
}

void match_right(std::span<const Landmark> landmarks, const SE3& T_camera_keyframe, const StereoCamera& camera,
                 double offset, const vision::Pyramid& left, const vision::Pyramid& right,
                 std::vector<Sighting>& sightings) {
  for (Sighting& s : sightings) {
    const Landmark& landmark = landmarks[s.landmark];
    const double depth = (T_camera_keyframe * landmark.point).z();
    if (!(depth > kMinViewDepth)) continue;
    const auto u = static_cast<float>(s.pixel.x()), v = static_cast<float>(s.pixel.y());
    const double expected = camera.f * camera.baseline / depth + offset;
    const auto found = vision::refine_stereo(left, right, u, v, landmark.level, static_cast<float>(expected));
    if (!found) continue;
    const double disparity = found->disparity - offset;
    if (disparity >= 0 && u - disparity >= 0) s.pixel.z() = u - disparity;
  }
}

}  // namespace relmap::tracking
