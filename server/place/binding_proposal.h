// What binding a frame to old landmarks needs: where a landmark should be seen, which landmarks the frame sees already,
// and how a feature becomes a re-observation.
#pragma once

#include <optional>
#include <unordered_set>
#include <vector>

#include "proto/geometry/camera.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::place {

inline constexpr std::uint32_t kBindingReach = 5;  // steps along the odometry, both ways

// The feature's pixel in both pictures; u_right is NaN where the feature or the camera has no disparity.
StereoPixel pixel_of(const AppearanceFeature& feature, const StereoCamera& camera);

// Where a camera should see a point, and how well that is known.
struct ExpectedPixel {
  StereoPixel pixel;
  Matrix3 covariance;  // of the prediction, without the noise of the measurement
};
// Projects `point` (in the match's frame) into the camera of a frame. `pose_covariance` is of T_match_frame Exp(xi).
// nullopt if the point is out of sight or the prediction is more uncertain than 20 pixels (one sigma).
std::optional<ExpectedPixel> expect(const Vector3& point, const Matrix3& point_covariance, const StereoCamera& camera,
                                    const SE3& T_frame_match, const Matrix6& pose_covariance);

// The landmarks in force that a frame sees already.
struct SeenLandmarks {
  std::unordered_set<LandmarkId> landmarks;
  std::vector<LandmarkId> of_track;  // the landmark of each observation of the frame
};
SeenLandmarks seen_by(const storage::Graph& graph, FrameId frame);

storage::ProposedBinding binding_to(LandmarkId landmark, const AppearanceFeature& feature, const StereoCamera& camera);

}  // namespace relmap::place
