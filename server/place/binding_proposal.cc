#include "server/place/binding_proposal.h"

#include "server/place/map_points.h"
#include "storage/graph/binding.h"

namespace relmap::place {

// A gate wider than this (pixels, one sigma) would be decided by descriptors alone.
static constexpr double kMaxGateSigma = 20;

std::optional<ExpectedPixel> expect(const Vector3& point, const Matrix3& point_covariance, const StereoCamera& camera,
                                    const SE3& T_frame_match, const Matrix6& pose_covariance) {
  const Vector3 p = T_frame_match * point;
  if (p.z() < 0.05) return std::nullopt;
  ExpectedPixel expected;
  expected.pixel = camera.project(p);
  if (!camera.in_picture(expected.pixel.x(), expected.pixel.y())) return std::nullopt;
  const Matrix3 H = camera.jacobian(p);
  Eigen::Matrix<double, 3, 6> J;  // by the right perturbation of T_match_frame: d p = -rho + [p]x phi
  J << -H, H * skew(p);
  const Matrix3 HR = H * T_frame_match.R;
  expected.covariance = J * pose_covariance * J.transpose() + HR * point_covariance * HR.transpose();
  if (expected.covariance.topLeftCorner<2, 2>().diagonal().maxCoeff() > kMaxGateSigma * kMaxGateSigma)
    return std::nullopt;
  return expected;
}

SeenLandmarks seen_by(const storage::Graph& graph, FrameId frame) {
  SeenLandmarks seen;
  if (const auto warm = graph.warm(frame))
    for (const storage::Observation& observation : warm->observations) {
      seen.of_track.push_back(storage::resolve(graph, observation.landmark));
      seen.landmarks.insert(seen.of_track.back());
    }
  return seen;
}

StereoPixel pixel_of(const AppearanceFeature& feature, const StereoCamera& camera) {
  const bool stereo = camera.is_stereo() && feature.disparity > 0;  // false also for NaN
  return {feature.u, feature.v, stereo ? double{feature.u} - feature.disparity : kNoRight};
}

storage::ProposedBinding binding_to(LandmarkId landmark, const AppearanceFeature& feature, const StereoCamera& camera) {
  storage::ProposedBinding binding;
  binding.landmark = landmark;
  binding.track = feature.track;
  binding.u_left = feature.u;
  binding.v = feature.v;
  binding.u_right = static_cast<float>(pixel_of(feature, camera).z());
  binding.level = static_cast<std::uint8_t>(level_of_scale(feature.scale));
  return binding;
}

}  // namespace relmap::place
