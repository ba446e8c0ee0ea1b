#include "frontend/vision/tolerant_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "frontend/vision/lens_refinement.h"

namespace relmap::vision {

namespace {

// The errors of the points of a place are correlated, so they determine the lens less well than independent points
// would: its standard deviations are multiplied by this factor.
constexpr double kOverstated = 2;

// The pose's covariance, with the standard deviations of the lens multiplied by kOverstated.
Matrix6 marginal_covariance(const LensModel::Information& joint) {
  const auto with_lens = joint.topRightCorner<6, Lens::kParameters>();
  const auto lens = joint.bottomRightCorner<Lens::kParameters, Lens::kParameters>();
  const Matrix6 of_lens = with_lens * lens.ldlt().solve(with_lens.transpose());
  return joint.topLeftCorner<6, 6>() + (kOverstated * kOverstated - 1) * of_lens;
}

// The points as they would be if their disparities in the reference frame were larger by `pixels`.
std::vector<Correspondence> with_disparity(std::vector<Correspondence> correspondences, double pixels,
                                           const StereoCamera& map_camera) {
  for (Correspondence& c : correspondences)
    if (c.point.z() > 0) c.point /= 1 + pixels * c.point.z() / (map_camera.f * map_camera.baseline);
  return correspondences;
}

}  // namespace

Result<Motion> estimate_tolerant_motion(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                                        const StereoCamera& map_camera, const SE3& start,
                                        const MotionOptions& options) {
  std::vector<std::uint32_t> original;
  const std::vector<Correspondence> left = left_only(correspondences, &original);
  LensPrior prior{lens_of(camera)};
  prior.inverse_sigma = lens_sigmas(kTolerable, camera, camera.f).cwiseInverse();
  const LensProblem problem(left, camera, prior, options);
  const LensProblem::State named{start, prior.mean};
  const auto refined =
      refine_lens(problem, named, problem.inliers(named), static_cast<std::size_t>(std::max(3, options.min_inliers)));
  if (!refined.ok()) return refined.status();
  Motion motion = marginal_motion(problem, *refined, marginal_covariance(refined->fit.covariance()), original);

  const std::vector<Correspondence> nearer = with_disparity(left, kTolerableDisparity, map_camera);
  const LensProblem shifted(nearer, camera, prior, options);
  const auto moved = refine(LensModel(shifted, refined->inliers), refined->fit.state, 10);
  if (!moved) return Status(Reason::NO_CALIBRATION, "no pose is the best one");
  const Vector6 step = (motion.T_reference_camera.inverse() * moved->state.T).log();
  motion.covariance += step * step.transpose();
  if (!motion.covariance.allFinite() || Eigen::LLT<Matrix6>(motion.covariance).info() != Eigen::Success)
    return {Reason::NO_CALIBRATION, "what is seen does not tell a pose and a lens"};
  return motion;
}

}  // namespace relmap::vision
