#include "frontend/vision/rig_check.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include "frontend/vision/sharpness.h"

namespace relmap {

namespace {

constexpr int kLeastSide = 64;  // pixels
constexpr int kSaturated = 250, kBlack = 5;
constexpr std::size_t kLeastMatches = 50;
constexpr double kMostRowError = 1;  // pixels
constexpr double kParallel = 1;      // pixels of disparity that tell no side
constexpr double kWidestEdge = 4.5;  // pixels; what is in focus has 2 to 3
constexpr double kSoftEdge = 3;      // pixels, from which on it matters that the other eye is
constexpr double kWiderEdge = 1.4;   // times sharper

template <typename... Parts>
Status finding(Reason reason, const Parts&... parts) {
  std::ostringstream text;
  text.precision(3);
  (text << ... << parts);
  return {reason, text.str()};
}

// 0 of none.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double share_of(ImageView picture, int from, int to) {
  std::int64_t count = 0;
  for (int y = 0; y < picture.height; ++y)
    count += std::count_if(picture.row(y), picture.row(y) + picture.width,
                           [&](std::uint8_t pixel) { return pixel >= from && pixel <= to; });
  return static_cast<double>(count) / (static_cast<double>(picture.width) * picture.height);
}

// Row errors as a plane over the left picture, -0.5..0.5 along each side.
struct RowTrend {
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();  // offset, slopes
  int width = 0, height = 0;

  Eigen::Vector3d at(const CornerMatch& match) const {
    return {1, match.u_left / width - 0.5, match.v_left / height - 0.5};
  }
  double residual(const CornerMatch& match) const { return match.v_right - match.v_left - plane.dot(at(match)); }
};

// Of those that agree: three robust standard deviations.
double most_residual(const std::vector<CornerMatch>& matches, const RowTrend& trend) {
  std::vector<double> sizes;
  for (const CornerMatch& match : matches) sizes.push_back(std::abs(trend.residual(match)));
  return std::max(1.0, 3 * 1.48 * quantile(std::move(sizes), 0.5));
}

// Fitted to the matches that agree with it; the others, chance likenesses, are taken out of `matches`.
RowTrend fit_rows(std::vector<CornerMatch>& matches, int width, int height) {
  RowTrend trend;
  trend.width = width, trend.height = height;
  std::vector<double> errors;
  for (const CornerMatch& match : matches) errors.push_back(match.v_right - match.v_left);
  trend.plane[0] = quantile(errors, 0.5);
  for (int round = 0; round < 5; ++round) {
    const double most = most_residual(matches, trend);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Identity() * 1e-6;
    Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
    for (const CornerMatch& match : matches) {
      if (std::abs(trend.residual(match)) > most) continue;
      const Eigen::Vector3d row = trend.at(match);
      normal += row * row.transpose();
      right_side += row * (match.v_right - match.v_left);
    }
    trend.plane = normal.ldlt().solve(right_side);
  }
  const double most = most_residual(matches, trend);
  std::erase_if(matches, [&](const CornerMatch& match) { return std::abs(trend.residual(match)) > most; });
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
  report.row_offset = trend.plane[0];
  report.row_slope_x = trend.plane[1];
  report.row_slope_y = trend.plane[2];
}

bool soft(const EyeReport& eye, const EyeReport& other) {
  if (!eye.edge_width) return other.edge_width.has_value();
  if (*eye.edge_width > kWidestEdge) return true;
  return other.edge_width && *eye.edge_width > kSoftEdge && *eye.edge_width > kWiderEdge * *other.edge_width;
}

Status out_of_focus(const char* name, const EyeReport& eye, const EyeReport& other) {
  if (!eye.edge_width)
    return finding(Reason::OUT_OF_FOCUS, "the ", name, " eye shows no edges; the other's are ", *other.edge_width,
                   " px wide");
  return finding(Reason::OUT_OF_FOCUS, "the ", name, " eye's edges are ", *eye.edge_width, " px wide, the other's ",
                 other.edge_width.value_or(0), "; in focus they have 2 to 3");
}

}  // namespace

void RigCheck::Eye::add(ImageView picture) {
  exposures.push_back(measure_exposure(picture));
  blind += exposures.back().blind();
  repeated += same_picture(picture, last);
  last = copy_of(picture);
  saturated += share_of(picture, kSaturated, 255);
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
  // Motion blurs, too: the sharper pairs tell the focus.
  if (!edge_widths.empty()) report.edge_width = quantile(edge_widths, 0.25);
  return report;
}

Status RigCheck::add(ImageView left, ImageView right) {
  const auto size = [](ImageView picture) {
    return std::to_string(picture.width) + " x " + std::to_string(picture.height);
  };
  const bool first = pairs_ == 0;
  if (left.width != right.width || left.height != right.height || left.width < kLeastSide || left.height < kLeastSide ||
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
  return {};
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
  if (matches.size() >= kLeastMatches) {
    measure_rows(matches, rows, report);
    measure_disparities(matches, report);
  }

  auto& findings = report.findings;
  // With an eye that shows nothing of its own, the numbers above mean nothing.
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
  if (!findings.empty()) return report;

  if (soft(report.left, report.right)) findings.push_back(out_of_focus("left", report.left, report.right));
  if (soft(report.right, report.left)) findings.push_back(out_of_focus("right", report.right, report.left));
  if (matches.size() < kLeastMatches) {
    if (findings.empty())
      findings.push_back(finding(Reason::TOO_FEW_FEATURES, "only ", matches.size(), " corners are seen by both eyes; ",
                                 kLeastMatches, " are needed: show both the same things, with texture"));
    return report;
  }
  if (no_disparity(matches))
    findings.push_back(
        finding(Reason::NOT_STEREO, "no disparity anywhere: both eyes show the same, or there is nothing near"));
  else if (report.positive_disparity < 0.5)
    findings.push_back(finding(Reason::NOT_STEREO, "the eyes are exchanged: only ", 100 * report.positive_disparity,
                               " % of the disparities are positive, ", report.disparity, " px in the median"));
  if (report.row_error > kMostRowError)
    findings.push_back(finding(Reason::ROWS_APART, "what both eyes see lies ", report.row_error,
                               " rows apart (90 %: ", report.row_error_90, "), ", report.row_offset, " in the middle, ",
                               report.row_slope_x, " more from left to right, ", report.row_slope_y,
                               " from top to bottom: not the calibration of this camera, or no longer"));
  return report;
}

}  // namespace relmap
