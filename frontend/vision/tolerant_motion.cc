#include "frontend/vision/tolerant_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "frontend/vision/lens_refinement.h"

namespace relmap {

Result<Motion> estimate_tolerant_motion(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                                        const SE3& start, const MotionOptions& options) {
  std::vector<std::uint32_t> original;
  const std::vector<Correspondence> left = left_only(correspondences, &original);
  LensPrior prior{lens_of(camera)};
  prior.inverse_sigma =
      lens_sigmas(kTolerableF, kTolerableK1, kTolerableK2, kTolerableCentre, camera, camera.f).cwiseInverse();
  const LensProblem problem(left, camera, prior, options);
  const LensProblem::State named{start, prior.mean};
  const auto settled =
      settle_lens(problem, named, problem.inliers(named), static_cast<std::size_t>(std::max(3, options.min_inliers)));
  if (!settled.ok()) return settled.status();
  Motion motion = marginal_motion(problem, *settled, original);
  if (!motion.covariance.allFinite() || Eigen::LLT<Matrix6>(motion.covariance).info() != Eigen::Success)
    return {Reason::NO_CALIBRATION, "what is seen does not tell a pose and a lens"};
  return motion;
}

}  // namespace relmap
