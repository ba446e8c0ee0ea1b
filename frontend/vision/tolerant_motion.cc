#include "frontend/vision/tolerant_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "frontend/vision/lens_refinement.h"

namespace relmap::vision {

namespace {

// What the points of a place have wrong they have wrong together: what they say of a lens is worth less than as many
// independent ones would say, by so many times in its standard deviation.
constexpr double kOverstated = 2;

// The pose's covariance, with the lens known so much worse than the joint one has it.
Matrix6 marginal_covariance(const LensModel::Information& joint) {
  const auto with_lens = joint.topRightCorner<6, Lens::kParameters>();
  const auto lens = joint.bottomRightCorner<Lens::kParameters, Lens::kParameters>();
  const Matrix6 of_lens = with_lens * lens.ldlt().solve(with_lens.transpose());
  return joint.topLeftCorner<6, 6>() + (kOverstated * kOverstated - 1) * of_lens;
}

// As they would be with so many pixels more of disparity in the frame that they are given in.
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
  const auto settled =
      settle_lens(problem, named, problem.inliers(named), static_cast<std::size_t>(std::max(3, options.min_inliers)));
  if (!settled.ok()) return settled.status();
  Motion motion = marginal_motion(problem, *settled, marginal_covariance(settled->refined.covariance()), original);

  const std::vector<Correspondence> nearer = with_disparity(left, kTolerableDisparity, map_camera);
  const LensProblem shifted(nearer, camera, prior, options);
  const auto moved = refine(LensModel(shifted, settled->inliers), settled->refined.state, 10);
  if (!moved) return Status(Reason::NO_CALIBRATION, "no pose is the best one");
  const Vector6 step = (motion.T_reference_camera.inverse() * moved->state.T).log();
  motion.covariance += step * step.transpose();
  if (!motion.covariance.allFinite() || Eigen::LLT<Matrix6>(motion.covariance).info() != Eigen::Success)
    return {Reason::NO_CALIBRATION, "what is seen does not tell a pose and a lens"};
  return motion;
}

}  // namespace relmap::vision
