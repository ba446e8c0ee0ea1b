// Estimates pose and lens of a camera together, from points that it sees and a prior of the lens. Internal to
// frontend/vision.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "frontend/vision/lens.h"
#include "frontend/vision/motion.h"
#include "frontend/vision/robust_refinement.h"
#include "proto/geometry/covariance.h"

namespace relmap::vision {

// Independent Gaussian priors of the parameters. An inverse sigma of 0 means that a parameter has no prior.
struct LensPrior {
  Lens mean;
  Lens::Parameters inverse_sigma = Lens::Parameters::Zero();
};

// The squared distance of the picture's corners from its centre, normalised by f.
inline double corner_r2(const StereoCamera& picture, double f) {
  return Vector2(0.5 * (picture.width - 1), 0.5 * (picture.height - 1)).squaredNorm() / (f * f);
}

// Standard deviations of a lens's parameters, in units that do not depend on the picture's size. `k1` and `k2` are
// given by how far they move the picture's corners, as a share of the corners' distance from the centre; `centre`, of
// the principal point, is a share of the longer side.
struct LensSigmas {
  double log_f, k1, k2, centre, log_aspect;
};
// The same in the units of Lens::Parameters, for a picture of that size and a focal length of f pixels.
inline Lens::Parameters lens_sigmas(const LensSigmas& of, const StereoCamera& picture, double f) {
  const double side = std::max(picture.width, picture.height);
  const double r2 = corner_r2(picture, f);
  Lens::Parameters sigmas;
  sigmas << of.log_f, of.k1 / r2, of.k2 / (r2 * r2), of.centre * side, of.centre * side, of.log_aspect;
  return sigmas;
}

inline Lens lens_of(const StereoCamera& camera) { return {camera.f, camera.cx, camera.cy, 0, 0}; }

// The errors that even a good calibration may have.
inline constexpr LensSigmas kTolerable{.log_f = 0.015, .k1 = 0.02, .k2 = 0.02, .centre = 0.005, .log_aspect = 0.003};
// The error that all disparities of a map may have in common, in pixels. Seen from another distance, it looks like
// another focal length.
inline constexpr double kTolerableDisparity = 1;

// Returns the usable correspondences without their right pixels. `original`, if given, receives their indices.
inline std::vector<Correspondence> left_only(std::span<const Correspondence> correspondences,
                                             std::vector<std::uint32_t>* original = nullptr) {
  std::vector<Correspondence> left;
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    Correspondence c = correspondences[i];
    c.pixel.z() = kNoRight;
    if (!usable(c)) continue;
    left.push_back(c);
    if (original) original->push_back(static_cast<std::uint32_t>(i));
  }
  return left;
}

class LensProblem {
 public:
  // Only the size of `picture` is used. The arguments must outlive the problem.
  LensProblem(std::span<const Correspondence> mono, const StereoCamera& picture, const LensPrior& prior,
              const MotionOptions& options)
      : all_(mono), picture_(picture), prior_(prior), options_(options) {}

  struct State {
    SE3 T;  // T_reference_camera
    Lens lens;
  };
  static constexpr int kParameters = 6 + Lens::kParameters;
  using Residual = CorrespondenceResidual<kParameters>;

  std::size_t size() const { return all_.size(); }

  const Correspondence& operator[](std::size_t i) const { return all_[i]; }

  Residual residual(const SE3& T_camera_reference, const Lens& lens, const Correspondence& c,
                    bool with_jacobian) const {
    Residual r;
    const Vector3 p = T_camera_reference * c.point;
    if (!(p.z() > kMinDepth)) return r;
    if (!(lens.slope((p.head<2>() / p.z()).squaredNorm()) > Lens::kMinSlope)) return r;
    r.rows = 2;
    r.value << c.pixel.head<2>() - lens.project(p), 0;
    const Lens::PointJacobian H = lens.jacobian(p);
    r.covariance = c.sigma * c.sigma * Matrix3::Identity();
    if (!c.point_covariance.isZero(0)) {
      const Lens::PointJacobian HR = H * T_camera_reference.R;
      r.covariance.topLeftCorner<2, 2>() += HR * c.point_covariance * HR.transpose();
    }
    r.covariance(2, 2) = 1;
    if (with_jacobian) {
      r.jacobian.setZero();
      r.jacobian.block<2, 3>(0, 0) = H;
      r.jacobian.block<2, 3>(0, 3) = -H * skew(p);
      r.jacobian.block<2, Lens::kParameters>(0, 6) = -lens.lens_jacobian(p);
    }
    return r;
  }

  // Indices of the inliers, ascending. A point that is predicted far outside of the picture is none: a point just
  // before the eye has so uncertain a direction that it could pass the gate there, and would distort the lens like no
  // other.
  std::vector<std::uint32_t> inliers(const State& state) const {
    const SE3 inverse = state.T.inverse();
    std::vector<std::uint32_t> result;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const Residual r = residual(inverse, state.lens, all_[i], false);
      if (agrees(r, options_.gate_sigmas, picture_.width) && about_in_picture(all_[i].pixel - r.value))
        result.push_back(static_cast<std::uint32_t>(i));
    }
    return result;
  }

  // Sum of the squared residuals in sigmas over all correspondences, each cut off at `max_cost`. A point behind the
  // camera costs `max_cost`.
  double cost(const State& state, double max_cost) const {
    const SE3 inverse = state.T.inverse();
    double sum = 0;
    for (const Correspondence& c : all_) {
      const Residual r = residual(inverse, state.lens, c, false);
      sum += r.rows == 0 ? max_cost : std::min(max_cost, mahalanobis_squared(r.value, r.covariance));
    }
    return sum;
  }

  // The difference of the lens from the prior's mean, in the prior's standard deviations.
  Lens::Parameters departure(const Lens& lens) const {
    return lens.minus(prior_.mean).cwiseProduct(prior_.inverse_sigma);
  }
  const Lens::Parameters& inverse_sigma() const { return prior_.inverse_sigma; }

 private:
  static constexpr double kMinDepth = 1e-3;  // metres; nothing nearer can be seen
  static constexpr double kMargin = 0.1;     // around the picture, as a share of its width

  bool about_in_picture(const Vector3& pixel) const {
    const double margin = kMargin * picture_.width;
    return pixel.x() > -margin && pixel.x() < picture_.width + margin && pixel.y() > -margin &&
           pixel.y() < picture_.height + margin;
  }

  std::span<const Correspondence> all_;
  const StereoCamera& picture_;
  const LensPrior& prior_;
  const MotionOptions& options_;
};

// Pose and lens over the correspondences that are `active`.
class LensModel {
 public:
  static constexpr int kParameters = LensProblem::kParameters;
  using State = LensProblem::State;
  using Information = Eigen::Matrix<double, kParameters, kParameters>;
  using Perturbation = Eigen::Matrix<double, kParameters, 1>;

  LensModel(const LensProblem& problem, const std::vector<std::uint32_t>& active)
      : problem_(problem), active_(active) {}

  std::size_t size() const { return active_.size(); }
  auto at(const State& state) const {
    return [this, inverse = state.T.inverse(), lens = state.lens](std::size_t k, bool with_jacobian) {
      return problem_.residual(inverse, lens, problem_[active_[k]], with_jacobian);
    };
  }
  State plus(const State& state, const Perturbation& x) const {
    return {state.T * SE3::exp(x.head<6>()), state.lens.plus(x.tail<Lens::kParameters>())};
  }
  State normalized(const State& state) const { return {state.T.normalized(), state.lens}; }
  double prior_cost(const State& state) const { return problem_.departure(state.lens).squaredNorm(); }
  void add_prior(const State& state, Information& A, Perturbation& b) const {
    const Lens::Parameters& inverse = problem_.inverse_sigma();
    A.diagonal().tail<Lens::kParameters>() += inverse.cwiseAbs2();
    b.tail<Lens::kParameters>() += inverse.cwiseProduct(problem_.departure(state.lens));
  }

 private:
  const LensProblem& problem_;
  const std::vector<std::uint32_t>& active_;
};

struct RefinedLens {
  Refined<LensModel> fit;
  std::vector<std::uint32_t> inliers;  // indices, ascending
};

// Refines pose and lens over the inliers and determines the inliers again, until they no longer change (or after 12
// rounds). NO_CALIBRATION if the correspondences do not determine a pose and a lens; TOO_FEW_INLIERS.
inline Result<RefinedLens> refine_lens(const LensProblem& problem, LensProblem::State state,
                                       std::vector<std::uint32_t> inliers, std::size_t min_inliers) {
  constexpr int kRounds = 12;
  constexpr int kIterations = 10;
  std::optional<Refined<LensModel>> refined;
  for (int round = 0; round < kRounds; ++round) {
    refined = refine(LensModel(problem, inliers), state, kIterations);
    if (!refined) return Status(Reason::NO_CALIBRATION, "no pose is the best one");
    state = refined->state;
    auto again = problem.inliers(state);
    const bool unchanged = again == inliers;
    inliers = std::move(again);
    if (inliers.size() < min_inliers)
      return Status(Reason::TOO_FEW_INLIERS, std::to_string(inliers.size()) + " of " + std::to_string(problem.size()) +
                                                 " correspondences agree on a pose and a lens");
    if (unchanged) break;
  }
  return RefinedLens{*std::move(refined), std::move(inliers)};
}

// The motion alone, without the lens. `covariance` is the marginal covariance of the pose, computed by the caller;
// `original` holds the caller's indices of the problem's correspondences.
inline Motion marginal_motion(const LensProblem& problem, const RefinedLens& refined_lens, const Matrix6& covariance,
                              std::span<const std::uint32_t> original) {
  const auto& [fit, inliers] = refined_lens;
  Motion motion;
  motion.T_reference_camera = fit.state.T;
  motion.variance_factor = fit.variance_factor();
  motion.covariance = covariance;
  double squares = 0;
  const SE3 inverse = fit.state.T.inverse();
  for (const std::uint32_t i : inliers) {
    squares += problem.residual(inverse, fit.state.lens, problem[i], false).value.squaredNorm();
    motion.inliers.push_back(original[i]);
  }
  motion.rms_px = std::sqrt(squares / std::max<double>(1, 2.0 * static_cast<double>(inliers.size())));
  return motion;
}

}  // namespace relmap::vision
