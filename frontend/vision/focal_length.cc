#include "frontend/vision/focal_length.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace relmap {

namespace {

constexpr double kShortest = 0.4, kLongest = 4;  // longer sides
constexpr int kTried = 14;                       // each a fifth longer than the one before
constexpr int kTrials = 300;                     // of three points, for each of them
constexpr double kMostSigma = 0.35;
constexpr double kStep = 0.01;     // of log f, for differences
constexpr double kWideGate = 1e3;  // sigmas: nothing leaves the set that is refined
constexpr int kRefinements = 12, kRounds = 3;

StereoCamera with_focal_length(StereoCamera camera, double f) {
  camera.f = f;
  camera.baseline = 0;
  return camera;
}

// The robust cost over a fixed set as a function of log f, each time at the pose that is best for it.
class Profile {
 public:
  Profile(std::vector<Correspondence> inliers, const StereoCamera& camera, const MotionOptions& options)
      : inliers_(std::move(inliers)), camera_(camera), options_(options) {
    options_.gate_sigmas = kWideGate;
    options_.min_inliers = 3;
    options_.enough = 0;
    options_.limits.reset();
  }

  struct Point {
    double log_f = 0, cost = 0;
    Motion motion;
  };
  std::optional<Point> at(double log_f, const SE3& near) const {
    auto motion = estimate_motion(inliers_, with_focal_length(camera_, std::exp(log_f)), options_, &near);
    if (!motion.ok()) return std::nullopt;
    const double degrees = std::max(1.0, 2.0 * static_cast<double>(inliers_.size()) - 6);
    const double cost = motion->variance_factor * degrees;
    return Point{log_f, cost, std::move(*motion)};
  }

  // The least within [low, high], by golden sections.
  std::optional<Point> least(double low, double high, const SE3& near) const {
    constexpr double kGolden = 0.6180339887498949;
    auto left = at(high - kGolden * (high - low), near), right = at(low + kGolden * (high - low), near);
    for (int i = 0; left && right && i < kRefinements; ++i) {
      if (left->cost < right->cost) {
        high = right->log_f;
        right = std::move(left);
        left = at(high - kGolden * (high - low), right->motion.T_reference_camera);
      } else {
        low = left->log_f;
        left = std::move(right);
        right = at(low + kGolden * (high - low), left->motion.T_reference_camera);
      }
    }
    if (!left || !right) return std::nullopt;
    return left->cost < right->cost ? left : right;
  }

 private:
  const std::vector<Correspondence> inliers_;
  const StereoCamera camera_;
  MotionOptions options_;
};

std::vector<Correspondence> chosen(std::span<const Correspondence> all, std::span<const std::uint32_t> which) {
  std::vector<Correspondence> result;
  for (const std::uint32_t i : which) result.push_back(all[i]);
  return result;
}

}  // namespace

Result<MotionAndFocalLength> estimate_motion_and_focal_length(std::span<const Correspondence> correspondences,
                                                              const StereoCamera& camera,
                                                              const MotionOptions& options) {
  std::vector<Correspondence> mono(correspondences.begin(), correspondences.end());
  for (Correspondence& c : mono) c.pixel.z() = kNoRight;

  const double side = std::max(camera.width, camera.height);
  const double log_step = std::log(kLongest / kShortest) / (kTried - 1);
  MotionOptions few = options;
  few.max_trials = std::min(options.max_trials, kTrials);
  std::optional<Motion> best;
  double log_f = 0;
  Status refusal;
  for (int i = 0; i < kTried; ++i) {
    const double tried = std::log(kShortest * side) + i * log_step;
    auto motion = estimate_motion(mono, with_focal_length(camera, std::exp(tried)), few);
    if (!motion.ok()) {
      if (refusal.ok()) refusal = motion.status();
      continue;
    }
    const auto better = [](const Motion& a, const Motion& b) {
      return a.inliers.size() != b.inliers.size() ? a.inliers.size() > b.inliers.size() : a.rms_px < b.rms_px;
    };
    if (best && !better(*motion, *best)) continue;
    best = std::move(*motion);
    log_f = tried;
  }
  if (!best) return refusal;

  const auto unknown = [](const std::string& why) {
    return Status(Reason::NO_CALIBRATION, "what is seen does not tell the focal length (" + why + "): name the camera");
  };
  MotionAndFocalLength result;
  for (int round = 0; round < kRounds; ++round) {
    const Profile profile(chosen(mono, best->inliers), camera, options);
    const double reach = round == 0 ? 2 * log_step : log_step;
    const auto least = profile.least(log_f - reach, log_f + reach, best->T_reference_camera);
    if (!least) return unknown("no pose is the best one");
    const bool settled = std::abs(least->log_f - log_f) < 1e-3;
    log_f = least->log_f;
    // Who agrees with it.
    auto again =
        estimate_motion(mono, with_focal_length(camera, std::exp(log_f)), options, &least->motion.T_reference_camera);
    if (!again.ok()) return again.status();
    best = std::move(*again);
    if (settled || round == kRounds - 1) break;
  }
  if (log_f < std::log(kShortest * side) || log_f > std::log(kLongest * side))
    return unknown("it would be " + std::to_string(std::exp(log_f) / side) + " times the picture's longer side");

  // var(log f) from the curvature of the profile, and what log f does to the pose from its slope.
  const SE3& T = best->T_reference_camera;
  const Profile profile(chosen(mono, best->inliers), camera, options);
  const auto here = profile.at(log_f, T), shorter = profile.at(log_f - kStep, T), longer = profile.at(log_f + kStep, T);
  if (!here || !shorter || !longer) return unknown("no pose is the best one");
  const double curvature = (shorter->cost - 2 * here->cost + longer->cost) / (kStep * kStep);
  const double variance = curvature > 0 ? 2 / curvature * std::max(1.0, here->motion.variance_factor) : 1e9;
  if (!(variance < kMostSigma * kMostSigma)) return unknown("sigma " + std::to_string(std::sqrt(variance)));
  const Vector6 slope =
      (shorter->motion.T_reference_camera.inverse() * longer->motion.T_reference_camera).log() / (2 * kStep);
  best->covariance += variance * slope * slope.transpose();
  result.motion = std::move(*best);
  result.f = std::exp(log_f);
  result.sigma_log_f = std::sqrt(variance);
  return result;
}

}  // namespace relmap
