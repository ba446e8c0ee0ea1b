#include "frontend/vision/camera_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frontend/vision/lens_refinement.h"
#include "proto/number_text.h"

namespace relmap {

namespace {

using LensCovariance = Eigen::Matrix<double, Lens::kParameters, Lens::kParameters>;

// What is supposed of the lens beside the camera that is named: standard deviations of log f, of what k1 and k2 move
// the picture's corners by as a share of their distance from the centre, and of the principal point in longer sides.
constexpr double kPriorF = 0.3, kPriorK1 = 0.2, kPriorK2 = 0.1, kPriorCentre = 0.03;
// How well calibrations and maps are known at all, the same way.
constexpr double kTolerableF = 0.015, kTolerableK1 = 0.02, kTolerableK2 = 0.02, kTolerableCentre = 0.005;
// The squared distance of the lens that fits from the one that is named, in sigmas of both. Right calibrations of four
// recordings had up to 3.2, those with a focal length 5 % off 8.7 and more.
constexpr double kMostDistance = 8;
// By how much the named lens must explain what is seen worse: of the squared residuals, in sigmas, cut off at the gate.
// Where enough agrees on a lens right calibrations came to 0.6 each, wrong ones to 1 and more; where only a few do, a
// free lens bends to them, and right ones came to 1.7 each.
constexpr std::size_t kEnough = 40, kFew = 25;  // inliers
constexpr double kLeastGain = 40, kLeastGainEach = 0.4, kLeastGainEachOfFew = 2.5;

constexpr double kMostAgree = 0.75;  // of the correspondences: more do not agree with the named camera by chance
constexpr double kOtherFocalLengths[] = {0.8, 1.25};
constexpr int kTrials = 100;

constexpr double kMostLogBaseline = 0.12;
constexpr double kSigmas = 5;
constexpr std::size_t kLeastDisparities = 20;
constexpr double kLeastDisparity = 4;  // pixels; below, its error tells nothing of the baseline

Lens::Parameters sigmas(double f, double k1, double k2, double centre, const StereoCamera& camera) {
  const double side = std::max(camera.width, camera.height);
  const double corner_r2 = Vector2(0.5 * camera.width, 0.5 * camera.height).squaredNorm() / (camera.f * camera.f);
  return {f, k1 / corner_r2, k2 / (corner_r2 * corner_r2), centre * side, centre * side};
}

// Without their right pixels.
std::vector<Correspondence> left_only(std::span<const Correspondence> correspondences) {
  std::vector<Correspondence> left;
  for (Correspondence c : correspondences) {
    c.pixel.z() = kNoRight;
    if (usable(c)) left.push_back(c);
  }
  return left;
}

// Pose and lens that most agree with, from the pose of the named camera; and where little agrees with that, a pose that
// only chance has made, from those of a camera with another focal length.
std::optional<SettledLens> settle(const LensProblem& problem, std::span<const Correspondence> left,
                                  const LensProblem::State& named, const StereoCamera& camera,
                                  const MotionOptions& options) {
  std::optional<SettledLens> best;
  const auto start_from = [&](const LensProblem::State& state) {
    auto settled = settle_lens(problem, state, problem.inliers(state), kFew);
    if (settled.ok() && (!best || settled->inliers.size() > best->inliers.size())) best = *std::move(settled);
  };
  start_from(named);
  if (static_cast<double>(problem.inliers(named).size()) > kMostAgree * static_cast<double>(left.size())) return best;
  for (const double longer : kOtherFocalLengths) {
    StereoCamera other = camera;
    other.f *= longer;
    other.baseline = 0;
    MotionOptions few = options;
    few.max_trials = kTrials;
    const auto motion = estimate_motion(left, other, few);
    if (motion.ok()) start_from({motion->T_reference_camera, {other.f, other.cx, other.cy, 0, 0}});
  }
  return best;
}

// What the prior's mean does worse than what fits.
double gain(const LensProblem& problem, const LensProblem::State& named, const LensProblem::State& fits,
            double gate_sigmas) {
  const double most = 2 * gate_sigmas * gate_sigmas;
  const auto cost = [&](const LensProblem::State& state) {
    const SE3 inverse = state.T.inverse();
    double sum = 0;
    for (std::size_t i = 0; i < problem.size(); ++i) {
      const auto r = problem.residual(inverse, state.lens, problem[i], false);
      sum += r.rows == 0 ? most : std::min(most, r.value.dot(r.covariance.ldlt().solve(r.value)));
    }
    return sum;
  };
  return cost(named) - cost(fits);
}

std::string percent(double share) { return number_text(100 * std::abs(share)) + " %"; }

Status contradiction(const std::string& what) {
  return {Reason::WRONG_CALIBRATION, "what is seen of the place contradicts the camera's calibration: it fits " + what};
}

// By what is furthest off.
Status wrong_lens(const Lens::Parameters& off, const Lens::Parameters& sigma, const StereoCamera& camera) {
  const Lens::Parameters distance = off.cwiseAbs().cwiseQuotient(sigma);
  Eigen::Index furthest = 0;
  distance.maxCoeff(&furthest);
  if (furthest == 0)
    return contradiction("a focal length " + percent(std::exp(off[0]) - 1) + (off[0] > 0 ? " longer" : " shorter"));
  if (furthest > 2)
    return contradiction("a principal point " + percent(off.tail<2>().norm() / std::max(camera.width, camera.height)) +
                         " of the picture's longer side away");
  const double r2 = Vector2(0.5 * camera.width, 0.5 * camera.height).squaredNorm() / (camera.f * camera.f);
  return contradiction("a lens that moves the picture's corners by " + percent(r2 * (off[1] + r2 * off[2])) +
                       " of their distance from the centre, as before it is rectified");
}

struct LogScale {
  double disparity;
  double value;  // log of the depth by disparity over that by the map
};

// The median by disparity, which is by information; its standard deviation is that of the spread.
Status check_baseline(std::vector<LogScale> scales) {
  if (scales.size() < kLeastDisparities) return {};
  const auto weighted_median = [&] {
    std::sort(scales.begin(), scales.end(), [](const LogScale& a, const LogScale& b) { return a.value < b.value; });
    double all = 0, sum = 0;
    for (const LogScale& scale : scales) all += scale.disparity;
    for (const LogScale& scale : scales)
      if (sum += scale.disparity; 2 * sum >= all) return scale.value;
    return 0.0;
  };
  const double median = weighted_median();
  for (LogScale& scale : scales) scale.value = std::abs(scale.value - median);
  const double sigma = 1.48 * weighted_median() / std::sqrt(static_cast<double>(scales.size()));
  if (!(std::abs(median) > std::max(kMostLogBaseline, kSigmas * sigma))) return {};
  return contradiction("a baseline " + percent(std::exp(-median) - 1) + (median < 0 ? " longer" : " shorter"));
}

}  // namespace

Status check_camera(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                    const SE3& T_reference_camera, const MotionOptions& options) {
  const std::vector<Correspondence> left = left_only(correspondences);
  LensPrior prior{{camera.f, camera.cx, camera.cy, 0, 0}};
  prior.inverse_sigma = sigmas(kPriorF, kPriorK1, kPriorK2, kPriorCentre, camera).cwiseInverse();
  const LensProblem problem(left, camera, prior, options);
  const LensProblem::State named{T_reference_camera, prior.mean};
  const auto settled = settle(problem, left, named, camera, options);
  if (!settled || settled->inliers.size() < kFew) return {};
  const LensProblem::State& fits = settled->refined.state;

  const Lens& lens = fits.lens;
  Lens::Parameters off;
  off << std::log(lens.f / camera.f), lens.k1, lens.k2, lens.cx - camera.cx, lens.cy - camera.cy;
  LensCovariance covariance = settled->refined.covariance().bottomRightCorner<Lens::kParameters, Lens::kParameters>();
  covariance.diagonal() += sigmas(kTolerableF, kTolerableK1, kTolerableK2, kTolerableCentre, camera).cwiseAbs2();
  const double distance = off.dot(covariance.ldlt().solve(off));
  const auto all = static_cast<double>(left.size());
  const double least_gain =
      settled->inliers.size() >= kEnough ? std::max(kLeastGain, kLeastGainEach * all) : kLeastGainEachOfFew * all;
  if (distance > kMostDistance && gain(problem, named, fits, options.gate_sigmas) > least_gain)
    return wrong_lens(off, covariance.diagonal().cwiseSqrt(), camera);
  if (!camera.is_stereo()) return {};

  std::vector<LogScale> scales;
  const SE3 T_camera_reference = fits.T.inverse();
  for (const Correspondence& c : correspondences) {
    if (is_mono(c.pixel) || !usable(c)) continue;
    const Vector3 p = T_camera_reference * c.point;
    const double disparity = c.pixel.x() - c.pixel.z();
    if (!(p.z() > 0) || disparity < kLeastDisparity * c.sigma) continue;
    if ((lens.project(p) - c.pixel.head<2>()).norm() > options.gate_sigmas * c.sigma) continue;
    scales.push_back({disparity / c.sigma, std::log(camera.f * camera.baseline / (disparity * p.z()))});
  }
  return check_baseline(std::move(scales));
}

}  // namespace relmap
