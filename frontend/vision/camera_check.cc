#include "frontend/vision/camera_check.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frontend/vision/lens_refinement.h"
#include "proto/base/number_text.h"

namespace relmap::vision {

namespace {

using LensCovariance = Eigen::Matrix<double, Lens::kParameters, Lens::kParameters>;

// The prior of a lens that need not be the named one.
constexpr LensSigmas kFree{.log_f = 0.3, .k1 = 0.2, .k2 = 0.1, .centre = 0.03, .log_aspect = 0.2};
constexpr double kHeld = 1e-4;  // sigma of a parameter that is held fixed, as a share of kFree's
// Squared Mahalanobis distance between the lens that fits and the named one. With enough inliers, correct calibrations
// of four recordings had up to 3.2, and those with a focal length 5 % off 8.7 and more.
constexpr double kMaxDistance = 8;
// By how much the cost of the named lens (squared residuals in sigmas, cut off at the gate) must exceed that of the
// lens that fits: at least kMinGain, and kMinGainEach for each correspondence. With few inliers more is needed, since a
// free lens adapts to them.
constexpr std::size_t kEnough = 40, kFew = 25;  // inliers
constexpr double kMinGain = 40, kMinGainEach = 0.4, kMinGainEachOfFew = 2.5;

constexpr double kMaxAgree = 0.75;  // of the correspondences; more do not agree with the named camera by chance
constexpr double kOtherFocalLengths[] = {0.8, 1.25};
constexpr int kOtherTrials = 100;

constexpr double kMaxLogBaseline = 0.12;
constexpr double kBaselineSigmas = 5;
constexpr std::size_t kMinDisparities = 20;

// The prior's mean is the named lens; its sigmas are those of kFree times `freedom` (1 for a free parameter, kHeld for
// a fixed one).
LensPrior prior_of(const StereoCamera& camera, const Lens::Parameters& freedom) {
  LensPrior prior{lens_of(camera)};
  prior.inverse_sigma = lens_sigmas(kFree, camera, camera.f).cwiseProduct(freedom).cwiseInverse();
  return prior;
}

// Fits poses and lenses to what the left eye of the camera sees.
class Fits {
 public:
  Fits(std::span<const Correspondence> left, const StereoCamera& camera, const SE3& T_reference_camera,
       const MotionOptions& options)
      : left_(left), camera_(camera), named_{T_reference_camera, lens_of(camera)}, options_(options) {}

  struct Fit {
    LensProblem::State state;
    LensCovariance covariance;  // of the lens's parameters
    std::size_t inliers = 0;
    double cost = 0;  // over all correspondences: squared residuals in sigmas, cut off at the gate
  };

  // Starts from the pose of the named camera. If few correspondences agree with that pose, it may be a chance one; if
  // the focal length is free, the fit then also starts from poses of cameras with other focal lengths. Nothing if too
  // few correspondences agree.
  std::optional<Fit> fit(const Lens::Parameters& freedom) const {
    const LensPrior prior = prior_of(camera_, freedom);
    const LensProblem problem(left_, camera_, prior, options_);
    std::optional<Fit> best;
    const auto start_from = [&](const LensProblem::State& state) {
      const auto lens = refine_lens(problem, state, problem.inliers(state), kFew);
      if (!lens.ok() || (best && lens->inliers.size() <= best->inliers)) return;
      const auto& refined = lens->fit;
      best = Fit{refined.state, refined.covariance().bottomRightCorner<Lens::kParameters, Lens::kParameters>(),
                 lens->inliers.size(), cost(problem, refined.state)};
    };
    start_from(named_);
    const auto agree = static_cast<double>(problem.inliers(named_).size());
    if (freedom[Lens::kLogF] < 1 || agree > kMaxAgree * static_cast<double>(left_.size())) return best;
    MotionOptions few = options_;
    few.max_trials = kOtherTrials;
    for (const double longer : kOtherFocalLengths) {
      StereoCamera other = camera_;
      other.f *= longer;
      other.baseline = 0;
      if (const auto motion = estimate_motion(left_, other, few); motion.ok())
        start_from({motion->T_reference_camera, lens_of(other)});
    }
    return best;
  }

  // The cost of the named camera at its pose.
  double named_cost() const {
    const LensPrior prior = prior_of(camera_, Lens::Parameters::Ones());
    return cost(LensProblem(left_, camera_, prior, options_), named_);
  }

 private:
  double cost(const LensProblem& problem, const LensProblem::State& state) const {
    return problem.cost(state, 2 * options_.gate_sigmas * options_.gate_sigmas);
  }

  std::span<const Correspondence> left_;
  const StereoCamera& camera_;
  const LensProblem::State named_;
  const MotionOptions& options_;
};

std::string percent(double share) { return number_text(100 * std::abs(share)) + " %"; }

// Names the single cause that alone explains the most.
Status wrong_lens(const Fits& fits, const StereoCamera& camera) {
  struct Cause {
    Lens::Parameters freedom;
    std::string (*text)(const Lens& lens, const StereoCamera& camera);
    double allowance = 0;  // added to the cost of a cause with more free parameters
  };
  const auto focal_length = [](const Lens& lens, const StereoCamera& named) {
    return "a focal length " + percent(lens.f / named.f - 1) + (lens.f > named.f ? " longer" : " shorter");
  };
  const auto distortion = [](const Lens& lens, const StereoCamera& named) {
    const double r2 = corner_r2(named, named.f);
    const double share = r2 * (lens.k1 + r2 * lens.k2);
    return "a lens that moves the picture's corners " + std::string(share > 0 ? "out" : "in") + " by " +
           percent(share) + " of their distance from the centre, as before it is rectified";
  };
  const auto centre = [](const Lens& lens, const StereoCamera& named) {
    return "a principal point " + number_text(Vector2(lens.cx - named.cx, lens.cy - named.cy).norm()) +
           " pixels away in pictures " + std::to_string(named.width) + " pixels wide";
  };
  const auto shape = [](const Lens& lens, const StereoCamera&) {
    return "pictures that were stretched in " + std::string(lens.aspect > 1 ? "height" : "width") + " by " +
           percent(std::max(lens.aspect, 1 / lens.aspect) - 1);
  };
  const Lens::Parameters held = Lens::Parameters::Constant(kHeld);
  Cause causes[] = {{held, focal_length}, {held, distortion}, {held, centre}, {held, shape, kMinGain}};
  causes[0].freedom[Lens::kLogF] = 1;
  causes[1].freedom[Lens::kK1] = causes[1].freedom[Lens::kK2] = 1;
  causes[2].freedom[Lens::kCx] = causes[2].freedom[Lens::kCy] = 1;
  causes[3].freedom[Lens::kLogF] = causes[3].freedom[Lens::kLogAspect] = 1;
  std::optional<double> min_cost;
  std::string text = "another lens";
  for (const Cause& cause : causes) {
    const auto fit = fits.fit(cause.freedom);
    if (!fit || (min_cost && fit->cost + cause.allowance >= *min_cost)) continue;
    min_cost = fit->cost + cause.allowance;
    text = cause.text(fit->state.lens, camera);
  }
  return {Reason::WRONG_CALIBRATION, text};
}

// Fits measured = scale * expected + offset robustly. A wrong baseline is a scale; a yaw of one eye makes an offset.
struct Disparity {
  double expected, measured, sigma;  // pixels
};
Status check_baseline(const std::vector<Disparity>& disparities) {
  if (disparities.size() < kMinDisparities) return {};
  Vector2 line(1, 0);
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  double squares = 0;
  for (int round = 0; round < 10; ++round) {
    information = Eigen::Matrix2d::Identity() * 1e-9;
    Vector2 right_side = Vector2::Zero();
    squares = 0;
    for (const Disparity& d : disparities) {
      const Vector2 row(d.expected, 1);
      const double residual = (d.measured - row.dot(line)) / d.sigma;
      // Cauchy's weight; its scale keeps disparities in the fit that are a fifth off at first.
      const double weight = 1 / (1 + residual * residual / 9);
      information += weight / (d.sigma * d.sigma) * row * row.transpose();
      right_side += weight / (d.sigma * d.sigma) * d.measured * row;
      squares += weight * residual * residual;
    }
    line = information.ldlt().solve(right_side);
  }
  const double variance = std::max(1.0, squares / static_cast<double>(disparities.size() - 2));
  const double sigma = std::sqrt(variance * information.inverse()(0, 0));
  if (!(line[0] > 0.1)) return {};  // measured and expected disparities are unrelated
  const double log_scale = std::log(line[0]);
  if (!(std::abs(log_scale) > std::max(kMaxLogBaseline, kBaselineSigmas * sigma / line[0]))) return {};
  return {Reason::WRONG_CALIBRATION, "a baseline " + percent(line[0] - 1) + (line[0] > 1 ? " longer" : " shorter")};
}

}  // namespace

Status check_camera(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                    const SE3& T_reference_camera, const StereoCamera& map_camera, const MotionOptions& options) {
  const std::vector<Correspondence> left = left_only(correspondences);
  const Fits fits(left, camera, T_reference_camera, options);
  const auto free = fits.fit(Lens::Parameters::Ones());
  if (!free) return {};
  const auto held = fits.fit(Lens::Parameters::Constant(kHeld));

  const Lens::Parameters off = free->state.lens.minus(lens_of(camera));
  const double metres = T_reference_camera.t.norm();
  const double from_disparities =
      map_camera.is_stereo() ? metres * kTolerableDisparity / (map_camera.f * map_camera.baseline) : 0;
  LensCovariance covariance = free->covariance;
  LensSigmas tolerable = kTolerable;
  tolerable.log_f = std::hypot(kTolerable.log_f, from_disparities);
  covariance.diagonal() += lens_sigmas(tolerable, camera, camera.f).cwiseAbs2();
  const double distance = off.dot(covariance.ldlt().solve(off));
  const auto all = static_cast<double>(left.size());
  const double min_gain = free->inliers >= kEnough ? std::max(kMinGain, kMinGainEach * all) : kMinGainEachOfFew * all;
  const double named_cost = held ? std::min(held->cost, fits.named_cost()) : fits.named_cost();
  if (distance > kMaxDistance && named_cost - free->cost > min_gain) return wrong_lens(fits, camera);
  if (!camera.is_stereo() || !held) return {};

  std::vector<Disparity> disparities;
  const SE3 T_camera_reference = held->state.T.inverse();
  for (const Correspondence& c : correspondences) {
    if (is_mono(c.pixel) || !usable(c)) continue;
    const Vector3 p = T_camera_reference * c.point;
    if (!(p.z() > 0)) continue;
    const StereoPixel expected = camera.project(p);
    if ((expected - c.pixel).head<2>().norm() > options.gate_sigmas * c.sigma) continue;
    const double disparity = expected.x() - expected.z();
    // An uncertain depth makes the expected disparity uncertain, too.
    const double depth_sigma =
        std::sqrt((T_camera_reference.R * c.point_covariance * T_camera_reference.R.transpose())(2, 2));
    disparities.push_back({disparity, c.pixel.x() - c.pixel.z(), std::hypot(c.sigma, disparity * depth_sigma / p.z())});
  }
  return check_baseline(disparities);
}

}  // namespace relmap::vision
