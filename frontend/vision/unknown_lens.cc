#include "frontend/vision/unknown_lens.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "frontend/vision/robust_refinement.h"
#include "proto/number_text.h"

namespace relmap {

namespace {

constexpr double kShortest = 0.4, kLongest = 4;  // longer sides
constexpr int kTried = 14;                       // each a fifth longer than the one before
constexpr int kTrials = 300;                     // of three points, for each of them
constexpr double kMostSigma = 0.35;              // of log f
constexpr double kNearest = 1e-3;                // metres; nothing nearer can be seen
// The prior: standard deviations of what k1 and k2 move the picture's corners by, as a share of their distance from the
// centre, and of the principal point in longer sides.
constexpr double kSigmaK1 = 0.2, kSigmaK2 = 0.1, kSigmaCentre = 0.02;
constexpr double kTriedK1[] = {0, -0.2};  // the same share: none, and the barrel of a wide lens
constexpr int kRounds = 12;               // of counting who agrees
constexpr int kIterations = 10;

constexpr double kLeastSlope = 0.1;  // of the distortion: beyond, a pixel is too much of the world

using LensVector = Eigen::Matrix<double, Lens::kParameters, 1>;

// The radial factor g and the derivative of g r by r.
struct Radial {
  double g = 1, slope = 1;
};
Radial radial(const Lens& lens, double r2) {
  return {1 + r2 * (lens.k1 + r2 * lens.k2), 1 + r2 * (3 * lens.k1 + r2 * 5 * lens.k2)};
}

Vector2 centre_of(const StereoCamera& picture) { return {0.5 * (picture.width - 1), 0.5 * (picture.height - 1)}; }

// Of the picture's corners: the square of their distance from the centre, normalised.
double corner_r2(const StereoCamera& picture, double f) { return centre_of(picture).squaredNorm() / (f * f); }

// Mono correspondences and the prior of a camera whose picture is so large.
class LensProblem {
 public:
  // `f`: about the focal length.
  LensProblem(std::span<const Correspondence> all, const StereoCamera& picture, double f, const MotionOptions& options)
      : all_(all), width_(picture.width), options_(options), centre_(centre_of(picture)) {
    const double side = std::max(picture.width, picture.height);
    const double r2 = corner_r2(picture, f);
    inverse_sigma_ << 0, r2 / kSigmaK1, r2 * r2 / kSigmaK2, 1 / (kSigmaCentre * side), 1 / (kSigmaCentre * side);
  }

  struct State {
    SE3 T;  // T_reference_camera
    Lens lens;
  };
  static constexpr int kParameters = 6 + Lens::kParameters;
  using Residual = CorrespondenceResidual<kParameters>;

  const Correspondence& operator[](std::size_t i) const { return all_[i]; }

  Residual residual(const SE3& T_camera_reference, const Lens& lens, const Correspondence& c,
                    bool with_jacobian) const {
    Residual r;
    const Vector3 p = T_camera_reference * c.point;
    if (!(p.z() > kNearest)) return r;
    // Towards the turning point of the distortion nothing is seen well.
    const double r2 = (p.head<2>() / p.z()).squaredNorm();
    if (!(radial(lens, r2).slope > kLeastSlope)) return r;
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

  // Indices, ascending.
  std::vector<std::uint32_t> inliers(const State& state) const {
    const SE3 inverse = state.T.inverse();
    std::vector<std::uint32_t> result;
    for (std::size_t i = 0; i < all_.size(); ++i)
      if (agrees(residual(inverse, state.lens, all_[i], false), options_.gate_sigmas, width_))
        result.push_back(static_cast<std::uint32_t>(i));
    return result;
  }

  // What the lens departs from the prior's mean, in its standard deviations.
  LensVector departure(const Lens& lens) const {
    LensVector value;
    value << 0, lens.k1, lens.k2, lens.cx - centre_.x(), lens.cy - centre_.y();
    return value.cwiseProduct(inverse_sigma_);
  }
  const LensVector& inverse_sigma() const { return inverse_sigma_; }

 private:
  std::span<const Correspondence> all_;
  int width_;
  const MotionOptions& options_;
  Vector2 centre_;
  LensVector inverse_sigma_;
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
  State settle(const State& state) const { return {state.T.normalized(), state.lens}; }
  double prior_cost(const State& state) const { return problem_.departure(state.lens).squaredNorm(); }
  void add_prior(const State& state, Information& A, Perturbation& b) const {
    const LensVector& inverse = problem_.inverse_sigma();
    A.diagonal().tail<Lens::kParameters>() += inverse.cwiseAbs2();
    b.tail<Lens::kParameters>() += inverse.cwiseProduct(problem_.departure(state.lens));
  }

 private:
  const LensProblem& problem_;
  const std::vector<std::uint32_t>& active_;
};

// As a camera without distortion sees them; what is beyond the lens's turning point is left out.
struct Undistorted {
  std::vector<Correspondence> correspondences;
  std::vector<std::uint32_t> original;
};
Undistorted undistort(std::span<const Correspondence> seen, const Lens& lens) {
  Undistorted result;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto x = lens.undistort(seen[i].pixel.head<2>());
    if (!x) continue;
    Correspondence c = seen[i];
    c.pixel.head<2>() = lens.f * *x + Vector2(lens.cx, lens.cy);
    c.sigma /= radial(lens, x->squaredNorm()).slope;
    result.correspondences.push_back(c);
    result.original.push_back(static_cast<std::uint32_t>(i));
  }
  return result;
}

struct Start {
  Motion motion;
  Lens lens;
};

// The lens that most agree with.
Result<Start> search(std::span<const Correspondence> mono, const StereoCamera& picture, const MotionOptions& options) {
  const double side = std::max(picture.width, picture.height);
  const double log_step = std::log(kLongest / kShortest) / (kTried - 1);
  const Vector2 centre = centre_of(picture);
  MotionOptions few = options;
  few.max_trials = std::min(options.max_trials, kTrials);
  std::optional<Start> best;
  Status refusal;
  for (const double share : kTriedK1)
    for (int i = 0; i < kTried; ++i) {
      const double f = kShortest * side * std::exp(i * log_step);
      const Lens lens{f, centre.x(), centre.y(), share / corner_r2(picture, f), 0};
      const Undistorted seen = undistort(mono, lens);
      auto motion =
          estimate_motion(seen.correspondences, {f, centre.x(), centre.y(), 0, picture.width, picture.height}, few);
      if (!motion.ok()) {
        if (refusal.ok()) refusal = motion.status();
        continue;
      }
      for (std::uint32_t& inlier : motion->inliers) inlier = seen.original[inlier];
      const auto better = [](const Motion& a, const Motion& b) {
        return a.inliers.size() != b.inliers.size() ? a.inliers.size() > b.inliers.size() : a.rms_px < b.rms_px;
      };
      if (!best || better(*motion, best->motion)) best = Start{std::move(*motion), lens};
    }
  if (!best) return refusal;
  return *std::move(best);
}

}  // namespace

Vector2 Lens::project(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  return f * radial(*this, x.squaredNorm()).g * x + Vector2(cx, cy);
}

Lens::PointJacobian Lens::jacobian(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  const double r2 = x.squaredNorm();
  PointJacobian normalised;  // dx/dp
  normalised << 1, 0, -x.x(), 0, 1, -x.y();
  normalised /= p.z();
  const Eigen::Matrix2d distorted =
      radial(*this, r2).g * Eigen::Matrix2d::Identity() + 2 * (k1 + 2 * k2 * r2) * x * x.transpose();  // d(g x)/dx
  return f * distorted * normalised;
}

Lens::LensJacobian Lens::lens_jacobian(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  const double r2 = x.squaredNorm();
  LensJacobian J;
  J << f * radial(*this, r2).g * x, f * r2 * x, f * r2 * r2 * x, Vector2(1, 0), Vector2(0, 1);
  return J;
}

std::optional<Vector2> Lens::undistort(const Vector2& pixel) const {
  constexpr int kMostIterations = 50;
  const Vector2 distorted = (pixel - Vector2(cx, cy)) / f;
  const double target = distorted.norm();
  double r = target;  // Newton's: g(r) r = target
  for (int i = 0; i < kMostIterations; ++i) {
    const Radial at = radial(*this, r * r);
    if (!(at.slope > kLeastSlope)) return std::nullopt;
    const double step = (at.g * r - target) / at.slope;
    r -= step;
    if (std::abs(step) < 1e-12) return target > 0 ? Vector2(distorted * (r / target)) : Vector2(Vector2::Zero());
  }
  return std::nullopt;
}

Lens Lens::plus(const LensVector& step) const {
  return {f * std::exp(step[0]), cx + step[3], cy + step[4], k1 + step[1], k2 + step[2]};
}

Result<MotionAndLens> estimate_motion_and_lens(std::span<const Correspondence> correspondences,
                                               const StereoCamera& picture, const MotionOptions& options) {
  std::vector<Correspondence> mono;
  std::vector<std::uint32_t> original;
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    Correspondence c = correspondences[i];
    c.pixel.z() = kNoRight;
    if (!usable(c)) continue;
    mono.push_back(c);
    original.push_back(static_cast<std::uint32_t>(i));
  }
  auto start = search(mono, picture, options);
  if (!start.ok()) return start.status();
  const LensProblem problem(mono, picture, start->lens.f, options);

  const auto unknown = [](const std::string& why) {
    return Status(Reason::NO_CALIBRATION, "what is seen does not tell the lens (" + why + "): name the camera");
  };
  LensProblem::State state{start->motion.T_reference_camera, start->lens};
  std::vector<std::uint32_t> inliers = std::move(start->motion.inliers);
  std::optional<Refined<LensModel>> refined;
  for (int round = 0; round < kRounds; ++round) {
    refined = refine(LensModel(problem, inliers), state, kIterations);
    if (!refined) return unknown("no pose is the best one");
    state = refined->state;
    auto again = problem.inliers(state);
    const bool settled = again == inliers;
    inliers = std::move(again);
    if (settled) break;
    if (inliers.size() < static_cast<std::size_t>(std::max(3, options.min_inliers)))
      return Status(Reason::TOO_FEW_INLIERS, std::to_string(inliers.size()) + " of " + std::to_string(mono.size()) +
                                                 " correspondences agree on a pose and a lens");
  }
  const double side = std::max(picture.width, picture.height);
  if (!(state.lens.f > kShortest * side && state.lens.f < kLongest * side))
    return unknown("its focal length would be " + number_text(state.lens.f / side) + " times the longer side");

  MotionAndLens result;
  Motion& motion = result.motion;
  motion.T_reference_camera = state.T;
  motion.variance_factor = refined->variance_factor();
  const LensModel::Information covariance = refined->covariance();
  motion.covariance = covariance.topLeftCorner<6, 6>();
  const double variance = covariance(6, 6);
  if (!covariance.allFinite() || !(variance >= 0 && variance < kMostSigma * kMostSigma))
    return unknown("the sigma of its focal length is " + number_text(100 * std::sqrt(std::abs(variance))) + " %");
  if (Eigen::LLT<Matrix6>(motion.covariance).info() != Eigen::Success) return unknown("no pose is the best one");
  double squares = 0;
  const SE3 inverse = state.T.inverse();
  for (const std::uint32_t i : inliers) {
    squares += problem.residual(inverse, state.lens, mono[i], false).value.squaredNorm();
    motion.inliers.push_back(original[i]);
  }
  motion.rms_px = std::sqrt(squares / std::max<double>(1, 2.0 * static_cast<double>(inliers.size())));
  result.lens = state.lens;
  result.sigma_log_f = std::sqrt(variance);
  return result;
}

}  // namespace relmap
