// Which points of a place were matched with which features of a query: the evidence for an answer, on request
// (QueryPicture::keep_matches).
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/base/ids.h"
#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::place {

// A feature of the query and a point of the map that look alike.
struct PointMatch {
  std::uint32_t feature = 0;  // of the query
  // Where the point lies in the picture of the frame, pixels of its session's camera: measured there, or, if `seen_in`
  // is valid, where the point that this other frame beside it has measured projects.
  Vector2 pixel = Vector2::Zero();
  FrameId seen_in = {};
  bool inlier = false;           // it agrees with the transform that was found
  std::optional<Vector3> point;  // metres, in the frame; nullopt if only two pictures were compared
  // Pixels in the query between where the feature was measured and where the transform puts the point; nullopt if no
  // metric transform was found, or the point lies behind the query's camera.
  std::optional<double> residual = {};
};

// Fills the residuals by the query's pose. `camera` must have a focal length.
inline void set_residuals(std::span<const AppearanceFeature> features, const StereoCamera& camera,
                          const SE3& T_frame_query, std::vector<PointMatch>& matches) {
  const SE3 T_query_frame = T_frame_query.inverse();
  for (PointMatch& match : matches) {
    match.residual.reset();
    if (!match.point) continue;
    const Vector3 p = T_query_frame * *match.point;
    if (!(p.z() > 0)) continue;
    const AppearanceFeature& feature = features[match.feature];
    match.residual = (camera.project(p).head<2>() - Vector2(feature.u, feature.v)).norm();
  }
}

// The inliers first, each part in the order of the query's features.
inline void sort_matches(std::vector<PointMatch>& matches) {
  std::stable_sort(matches.begin(), matches.end(), [](const PointMatch& l, const PointMatch& r) {
    return l.inlier != r.inlier ? l.inlier : l.feature < r.feature;
  });
}

}  // namespace relmap::place
