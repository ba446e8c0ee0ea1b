#include "frontend/tracking/keyframe_pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/tracking/disparity_range.h"
#include "frontend/vision/appearance.h"
#include "frontend/vision/encoded_picture.h"
#include "frontend/vision/stereo_match.h"

namespace relmap::tracking {

namespace {

constexpr float kMinAppearanceDisparity = 0.5F;  // pixels
constexpr float kPatchScale = 5.0F;  // diameter of the SIFT keypoint that corresponds to a 9 x 9 patch on level 0

float disparity_of(const AppearanceFeature& feature, const Pair& pair, const StereoCamera& camera) {
  if (!pair.sees_left() || !pair.sees_right()) return std::numeric_limits<float>::quiet_NaN();
  const int level =
      std::clamp(static_cast<int>(std::lround(std::log2(feature.scale / kPatchScale))), 0, pair.left.levels() - 1);
  const auto match = vision::match_stereo(pair.left, pair.right, feature.u, feature.v, level,
                                          disparity_range(camera, kMinAppearanceDisparity));
  if (!match || feature.u - match->disparity < 0) return std::numeric_limits<float>::quiet_NaN();
  return match->disparity;
}

}  // namespace

std::vector<AppearanceFeature> appearance_set(const Pair& pair, const Keyframe& keyframe, double offset,
                                              int max_features) {
  const StereoCamera& camera = keyframe.session.camera;
  std::vector<vision::TrackedPosition> tracked;
  for (const TrackMeasurement& track : keyframe.tracks) {
    if (static_cast<int>(tracked.size()) >= max_features) break;
    tracked.push_back({track.u_left, track.v, track.level, static_cast<std::int16_t>(tracked.size())});
  }
  auto features = vision::detect_appearance(pair.picture, tracked, max_features);
  std::erase_if(features, [&](const AppearanceFeature& f) { return !camera.in_picture(f.u, f.v); });
  for (AppearanceFeature& feature : features) {
    if (feature.track < 0) {
      feature.disparity = disparity_of(feature, pair, camera) - static_cast<float>(offset);
      if (feature.disparity < 0) feature.disparity = std::numeric_limits<float>::quiet_NaN();
    } else {
      const TrackMeasurement& track = keyframe.tracks[static_cast<std::size_t>(feature.track)];
      feature.disparity = track.u_left - track.u_right;
    }
  }
  return features;
}

Bytes keyframe_picture(vision::ImageView picture, KeyframePicture kind) {
  if (kind == KeyframePicture::kNone) return {};
  return kind == KeyframePicture::kSmall ? vision::make_thumbnail(picture) : vision::encode_picture(picture);
}

}  // namespace relmap::tracking
