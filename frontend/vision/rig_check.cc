#include "frontend/vision/rig_check.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string>
#include <utility>

#include "frontend/vision/sharpness.h"
#include "proto/base/quantile.h"

namespace relmap::vision {

namespace {

constexpr int kMinPictureSide = 64;  // pixels
constexpr std::size_t kMinMatches = 50;
constexpr double kMaxRowError = 1;  // pixels
constexpr double kParallel = 1;     // pixels; the sign of a smaller disparity means nothing
constexpr double kExchanged = 0.1;  // eyes are exchanged below this share of positive disparities; good ones: over 0.99
constexpr double kExchangedUnrectified = 0.5;  // the same if the pictures may not be rectified
constexpr double kMaxNegative = 0.05;          // share of negative disparities that mismatches explain
constexpr double kMaxYawByRows = 0.75;         // degrees; good cameras have up to 0.56
constexpr double kMaxYawByMotion = 0.5;        // degrees; good cameras have up to 0.2
constexpr std::size_t kMinMotions = 3;
constexpr double kMaxRowsOfMotion = 4;  // pixels from the median row error; beyond that it is a mismatch
constexpr double kYawSigmas = 3;
constexpr double kDegrees = 180 / M_PI;
constexpr double kMaxEdge = 4.5;  // pixels; edges in focus have 2 to 3
// An eye with wider edges than this (pixels) is out of focus if the other eye is sharper by this factor.
constexpr double kSoftEdge = 3, kWiderEdge = 1.4;

template <typename... Parts>
Status finding(Reason reason, const Parts&... parts) {
  std::ostringstream text;
  text.precision(3);
  (text << ... << parts);
  return {reason, text.str()};
}

double share_of(ImageView picture, int from, int to) {
  std::int64_t count = 0;
  for (int y = 0; y < picture.height; ++y)
    count += std::count_if(picture.row(y), picture.row(y) + picture.width,
                           [&](std::uint8_t pixel) { return pixel >= from && pixel <= to; });
  return static_cast<double>(count) / (static_cast<double>(picture.width) * picture.height);
}

// Row errors as a function of the position in the picture (-0.5..0.5 along each side): a plane and a twist.
struct RowTrend {
  Eigen::Vector4d shape = Eigen::Vector4d::Zero();  // offset, two slopes, twist
  double twist_sigma = 0;
  int width = 0, height = 0;

  // The twist is a function of the position in the right picture, since it comes from the yaw of the right eye.
  Eigen::Vector4d at(const CornerMatch& match) const {
    const double x = match.u_left / width - 0.5, y = match.v_left / height - 0.5;
    return {1, x, y, (match.u_right / width - 0.5) * y};
  }
  double residual(const CornerMatch& match) const { return match.v_right - match.v_left - shape.dot(at(match)); }
};

// The largest residual of a match that agrees: three robust standard deviations, but at least a pixel.
double max_residual(const std::vector<CornerMatch>& matches, const RowTrend& trend) {
  std::vector<double> sizes;
  for (const CornerMatch& match : matches) sizes.push_back(std::abs(trend.residual(match)));
  return std::max(1.0, 3 * 1.48 * quantile(std::move(sizes), 0.5));
}

// Fits the trend to the matches that agree with it, and removes the others (mismatches) from `matches`.
RowTrend fit_rows(std::vector<CornerMatch>& matches, int width, int height) {
  RowTrend trend;
  trend.width = width, trend.height = height;
  std::vector<double> errors;
  for (const CornerMatch& match : matches) errors.push_back(match.v_right - match.v_left);
  trend.shape[0] = quantile(errors, 0.5);
  Eigen::Matrix4d normal = Eigen::Matrix4d::Identity();
  for (int round = 0; round < 5; ++round) {
    const double limit = max_residual(matches, trend);
    normal = Eigen::Matrix4d::Identity() * 1e-6;
    Eigen::Vector4d right_side = Eigen::Vector4d::Zero();
    for (const CornerMatch& match : matches) {
      if (std::abs(trend.residual(match)) > limit) continue;
      const Eigen::Vector4d row = trend.at(match);
      normal += row * row.transpose();
      right_side += row * (match.v_right - match.v_left);
    }
    trend.shape = normal.ldlt().solve(right_side);
  }
  const double limit = max_residual(matches, trend);
  std::erase_if(matches, [&](const CornerMatch& match) { return std::abs(trend.residual(match)) > limit; });
  double squares = 0;
  for (const CornerMatch& match : matches) squares += std::pow(trend.residual(match), 2);
  const double variance = matches.empty() ? 0 : squares / static_cast<double>(matches.size());
  trend.twist_sigma = std::sqrt(variance * normal.inverse()(3, 3));
  return trend;
}

void measure_disparities(const std::vector<CornerMatch>& matches, RigReport& report) {
  std::vector<double> disparities;
  int left = 0, right = 0;
  for (const CornerMatch& match : matches) {
    disparities.push_back(match.u_left - match.u_right);
    right += disparities.back() > kParallel;
    left += disparities.back() < -kParallel;
  }
  report.disparity = quantile(disparities, 0.5);
  report.positive_disparity = left + right > 0 ? static_cast<double>(right) / (left + right) : 0;
  report.negative_disparity = static_cast<double>(left) / static_cast<double>(matches.size());
}

// An eye of focal length f that is turned about its vertical axis by an angle sees a point at (x, y) from the principal
// point shifted by angle * x y / f rows. Nothing if three sigmas of the yaw exceed the largest tolerable yaw.
std::optional<double> yaw_by_rows(const RowTrend& trend, const StereoCamera& camera) {
  const double degrees = kDegrees * camera.f / (static_cast<double>(trend.width) * trend.height);
  if (kYawSigmas * trend.twist_sigma * degrees > kMaxYawByRows) return {};
  return trend.shape[3] * degrees;
}

std::optional<double> yaw_by_motion(std::vector<double> zeros, const StereoCamera& camera) {
  if (zeros.size() < kMinMotions) return {};
  const double median = quantile(zeros, 0.5);
  for (double& zero : zeros) zero = std::abs(zero - median);
  const double sigma = 1.48 * quantile(zeros, 0.5) / std::sqrt(static_cast<double>(zeros.size()));
  if (kYawSigmas * sigma > camera.f * std::tan(kMaxYawByMotion / kDegrees)) return {};
  return -kDegrees * std::atan(median / camera.f);
}

bool no_disparity(const std::vector<CornerMatch>& matches) {
  std::vector<double> sizes;
  for (const CornerMatch& match : matches) sizes.push_back(std::abs(match.u_left - match.u_right));
  return quantile(sizes, 0.95) <= kParallel;
}

void measure_rows(const std::vector<CornerMatch>& matches, const RowTrend& trend, RigReport& report) {
  std::vector<double> errors;
  for (const CornerMatch& match : matches) errors.push_back(std::abs(match.v_right - match.v_left));
  report.row_error = quantile(errors, 0.5);
  report.row_error_90 = quantile(errors, 0.9);
  report.row_offset = trend.shape[0];
  report.row_slope_x = trend.shape[1];
  report.row_slope_y = trend.shape[2];
}

bool soft(const EyeReport& eye, const EyeReport& other) {
  if (!eye.edge_width) return other.edge_width.has_value();
  if (*eye.edge_width > kMaxEdge) return true;
  return other.edge_width && *eye.edge_width > kSoftEdge && *eye.edge_width > kWiderEdge * *other.edge_width;
}

// The yaw, if it is too large. The yaw by motion takes precedence, since other errors of a calibration do not affect
// it.
std::optional<double> turned(const RigReport& report) {
  const std::optional<double>& yaw = report.yaw_by_motion ? report.yaw_by_motion : report.yaw_by_rows;
  if (yaw && std::abs(*yaw) > (report.yaw_by_motion ? kMaxYawByMotion : kMaxYawByRows)) return yaw;
  return {};
}

Status eye_turned(const RigReport& report, double yaw, const StereoCamera& camera) {
  return finding(Reason::NOT_STEREO, "the right eye is turned by ", std::abs(yaw), " degrees ",
                 yaw > 0 ? "towards" : "away from", " the left one, against the calibration, as ",
                 report.yaw_by_motion ? "their motion shows" : "the rows of both show", ": far things have ",
                 -camera.f * std::tan(yaw / kDegrees), " px of disparity instead of 0, and the path is too ",
                 yaw > 0 ? "long" : "short");
}

Status out_of_focus(const char* name, const EyeReport& eye, const EyeReport& other) {
  if (!eye.edge_width)
    return finding(Reason::OUT_OF_FOCUS, "the ", name, " eye shows no edges; the other's are ", *other.edge_width,
                   " px wide");
  return finding(Reason::OUT_OF_FOCUS, "the ", name, " eye's edges are ", *eye.edge_width, " px wide, the other's ",
                 other.edge_width.value_or(0), "; in focus they have 2 to 3");
}

}  // namespace

Status RigReport::what_is_wrong() const {
  if (!wrong) return {};
  const auto found = std::find_if(findings.begin(), findings.end(), [](const Status& finding) {
    return finding.reason() != Reason::OUT_OF_FOCUS && finding.reason() != Reason::TOO_FEW_FEATURES;
  });
  return found == findings.end() ? Status() : *found;
}

void RigCheck::Eye::add(ImageView picture) {
  exposures.push_back(measure_exposure(picture));
  blind += exposures.back().blind();
  repeated += same_picture(picture, last);
  last = copy_of(picture);
  saturated += share_of(picture, kWhite, 255);
  black += share_of(picture, 0, kBlack);
  if (const auto width = edge_width(picture)) edge_widths.push_back(*width);
}

EyeReport RigCheck::Eye::report() const {
  EyeReport report;
  const auto pairs = static_cast<double>(exposures.size());
  for (const Exposure& exposure : exposures) {
    report.mean += exposure.mean / pairs;
    report.deviation += exposure.deviation / pairs;
  }
  report.saturated = saturated / pairs;
  report.black = black / pairs;
  // Motion blurs some pairs; the sharper ones show the focus.
  if (!edge_widths.empty()) report.edge_width = quantile(edge_widths, 0.25);
  return report;
}

Status RigCheck::add(ImageView left, ImageView right, ImageView later) {
  const auto size = [](ImageView picture) {
    return std::to_string(picture.width) + " x " + std::to_string(picture.height);
  };
  const bool first = pairs_ == 0;
  if (left.width != right.width || left.height != right.height || left.width < kMinPictureSide ||
      left.height < kMinPictureSide ||
      (!first && (left.width != left_.last.width() || left.height != left_.last.height())))
    return {Reason::BAD_SIZE,
            "pictures of " + size(left) + " and " + size(right) +
                (first ? "; both eyes' must be of one size, 64 x 64 or more" : " after such of " + size(left_.last))};
  ++pairs_;
  left_.add(left);
  right_.add(right);
  if (left_.exposures.back().blind() || right_.exposures.back().blind()) return {};
  if (same_picture(left, right)) {
    ++same_;
    return {};
  }
  const auto matches = match_corners(left, right);
  matches_.insert(matches_.end(), matches.begin(), matches.end());
  if (camera_ && later.width == left.width && later.height == left.height) add_motion(matches, left, later);
  return {};
}

void RigCheck::add_motion(const std::vector<CornerMatch>& matches, ImageView left, ImageView later) {
  if (measure_exposure(later).blind() || same_picture(left, later)) return;
  // match_corners() chooses the same corners of the left picture both times.
  std::map<std::pair<float, float>, const CornerMatch*> stereo;
  for (const CornerMatch& match : matches) stereo[{match.u_left, match.v_left}] = &match;
  std::vector<double> errors;
  for (const CornerMatch& match : matches) errors.push_back(match.v_right - match.v_left);
  const double rows = quantile(std::move(errors), 0.5);
  std::vector<MovedCorner> moved;
  for (const CornerMatch& motion : match_corners(left, later)) {
    const auto found = stereo.find({motion.u_left, motion.v_left});
    if (found == stereo.end()) continue;
    const CornerMatch& match = *found->second;
    if (std::abs(match.v_right - match.v_left - rows) > kMaxRowsOfMotion) continue;
    moved.push_back({match.u_left, match.v_left, match.u_left - match.u_right, motion.u_right, motion.v_right});
  }
  if (const auto zero = disparity_zero(moved, *camera_)) zeros_.push_back(zero->pixels);
}

RigReport RigCheck::report() const {
  RigReport report;
  report.pairs = pairs_;
  if (pairs_ == 0) return report;
  report.left = left_.report();
  report.right = right_.report();
  std::vector<CornerMatch> matches = matches_;
  const RowTrend rows = fit_rows(matches, left_.last.width(), left_.last.height());
  report.matches = static_cast<int>(matches.size());
  if (matches.size() >= kMinMatches) {
    measure_rows(matches, rows, report);
    measure_disparities(matches, report);
    if (camera_) report.yaw_by_rows = yaw_by_rows(rows, *camera_);
  }
  report.motions = motions();
  if (camera_) report.yaw_by_motion = yaw_by_motion(zeros_, *camera_);

  auto& findings = report.findings;
  // If an eye shows nothing, or both show the same, the numbers above mean nothing.
  const auto mostly = [&](int pairs) { return 2 * pairs > pairs_; };
  const auto look = [&](const char* name, const Eye& eye, const EyeReport& seen, const Eye& other) {
    if (mostly(eye.blind))
      findings.push_back(finding(Reason::EYE_DEAD, "the ", name, " eye shows nothing: mean ", seen.mean, ", deviation ",
                                 seen.deviation, " grey levels (covered, or exposed wrongly?)"));
    else if (pairs_ > 1 && eye.repeated == pairs_ - 1 && other.repeated == 0)
      findings.push_back(finding(Reason::EYE_DEAD, "the ", name, " eye shows the same picture all the time"));
  };
  look("left", left_, report.left, right_);
  look("right", right_, report.right, left_);
  if (findings.empty() && mostly(same_))
    findings.push_back(finding(Reason::NOT_STEREO, "both eyes show the same picture"));
  report.wrong = !findings.empty();
  if (report.wrong) return report;

  if (soft(report.left, report.right)) findings.push_back(out_of_focus("left", report.left, report.right));
  if (soft(report.right, report.left)) findings.push_back(out_of_focus("right", report.right, report.left));
  if (matches.size() < kMinMatches) {
    if (findings.empty())
      findings.push_back(finding(Reason::TOO_FEW_FEATURES, "only ", matches.size(), " corners are seen by both eyes; ",
                                 kMinMatches, " are needed: show both the same things, with texture"));
    return report;
  }
  const auto wrong = [&](Status what) {
    findings.push_back(std::move(what));
    report.wrong = true;
  };
  const bool apart = report.row_error > kMaxRowError;
  if (apart)
    wrong(finding(Reason::ROWS_APART, "what both eyes see lies ", report.row_error,
                  " rows apart (90 %: ", report.row_error_90, "), ", report.row_offset, " in the middle, ",
                  report.row_slope_x, " more from left to right, ", report.row_slope_y,
                  " from top to bottom: not the calibration of this camera, or no longer"));
  if (no_disparity(matches))
    findings.push_back(
        finding(Reason::NOT_STEREO, "no disparity anywhere: both eyes show the same, or there is nothing near"));
  else if (report.positive_disparity < (camera_ ? kExchanged : kExchangedUnrectified))
    wrong(finding(Reason::NOT_STEREO, "the eyes are exchanged: only ", 100 * report.positive_disparity,
                  " % of the disparities are positive, ", report.disparity, " px in the median"));
  else if (const auto yaw = apart ? std::nullopt : turned(report))
    wrong(eye_turned(report, *yaw, *camera_));
  else if (!apart && camera_ && report.negative_disparity > kMaxNegative)
    wrong(finding(Reason::NOT_STEREO, 100 * report.negative_disparity,
                  " % of the disparities are negative, which those of things before the camera never are: an eye is "
                  "turned against the calibration, or the eyes are exchanged"));
  return report;
}

std::string rig_advice(Reason finding) {
  switch (finding) {
    case Reason::ROWS_APART:
      return "calibrate anew, or give the calibration of this very camera; pictures that are not rectified need the "
             "calibration of the raw ones";
    case Reason::NOT_STEREO:
      return "see that left and right are what they are called (folders, calibration, first_byte in a camera's "
             "settings) and that the calibration is this camera's; calibrate anew if it was knocked";
    case Reason::EYE_DEAD:
      return "see to its lens cap, its exposure, its cable";
    case Reason::OUT_OF_FOCUS:
      return "see to its lens and to dirt; hold still, in enough light";
    case Reason::TOO_FEW_FEATURES:
      return "point it at something with texture that both eyes see";
    default:
      return {};
  }
}

Status with_advice(const Status& finding) {
  const std::string advice = rig_advice(finding.reason());
  return {finding.reason(), finding.message() + (advice.empty() ? "" : "; what helps: " + advice)};
}

}  // namespace relmap::vision
