// What binding a frame to old landmarks needs: where they should be seen, which it sees already, and what a feature or
// a place in the picture says as a re-observation.
#pragma once

#include <optional>
#include <unordered_set>
#include <vector>

#include "proto/geometry/camera.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::place {

inline constexpr std::uint32_t kBindingReach = 5;  // steps along the odometry, both ways

// u_right NaN where the feature or the camera has no disparity.
StereoPixel pixel_of(const AppearanceFeature& feature, const StereoCamera& camera);

// Where a camera should see a point, and how well that is known.
struct ExpectedPixel {
  StereoPixel pixel;
  Matrix3 covariance;  // without the measurement's own
};
// Of a camera that stands at T_match_frame with this covariance (of T_match_frame Exp(xi)), `point` in the match's
// coordinates. Nothing if it is out of sight, or not known to 20 pixels.
std::optional<ExpectedPixel> expect(const Vector3& point, const Matrix3& point_covariance, const StereoCamera& camera,
                                    const SE3& T_frame_match, const Matrix6& pose_covariance);

// Landmarks in force that the frame sees already, and which of its tracks see them.
struct SeenLandmarks {
  std::unordered_set<LandmarkId> landmarks;
  std::vector<LandmarkId> of_track;  // by observation
};
SeenLandmarks seen_by(const storage::Graph& graph, FrameId frame);

storage::ProposedBinding binding_to(LandmarkId landmark, const AppearanceFeature& feature, const StereoCamera& camera);

}  // namespace relmap::place
