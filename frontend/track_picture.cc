#include "frontend/track_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <string>

#include "frontend/figures.h"

namespace relmap::frontend {

namespace {

constexpr int kMinWidth = 720;   // narrower pictures are enlarged by a whole number
constexpr int kBar = 46;         // height below the picture
constexpr int kOldest = 16;      // keyframes
constexpr double kFullTurn = 5;  // degrees at which the arrow reaches the ring
constexpr double kTiltFactor = 10;

const cv::Scalar kBarColour(38, 32, 30), kText(235, 235, 235), kDim(150, 145, 140), kShadow(20, 20, 20);
const cv::Scalar kKeyframe(110, 200, 70), kLost(60, 60, 235), kWarning(50, 170, 250), kRejected(200, 80, 255);

// Blue over green and yellow to red.
cv::Scalar colour_of_age(int age) {
  static const cv::Mat ramp = [] {
    cv::Mat grey(1, 256, CV_8U), colours;
    for (int i = 0; i < 256; ++i) grey.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::applyColorMap(grey, colours, cv::COLORMAP_TURBO);
    return colours;
  }();
  // Differences between the first keyframes matter most; the ends of the ramp are too dark to be seen.
  const double old = std::min(1.0, std::log2(1.0 + age) / std::log2(1.0 + kOldest));
  const auto colour = ramp.at<cv::Vec3b>(0, 30 + static_cast<int>(195 * old));
  return {static_cast<double>(colour[0]), static_cast<double>(colour[1]), static_cast<double>(colour[2])};
}

void text(cv::Mat& canvas, const std::string& words, cv::Point at, const cv::Scalar& colour, double size = 0.55) {
  cv::putText(canvas, words, at, cv::FONT_HERSHEY_SIMPLEX, size, colour, 1, cv::LINE_AA);
}

int width_of(const std::string& words, double size = 0.55) {
  int baseline = 0;
  return cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, size, 1, &baseline).width;
}

// Writes text that is legible on any picture.
void darken(cv::Mat& canvas, const cv::Rect& box) {
  cv::Mat behind = canvas(box & cv::Rect(0, 0, canvas.cols, canvas.rows));
  behind.convertTo(behind, -1, 0.35);
}

void draw_landmarks(cv::Mat& canvas, const tracking::PairReport& report, int scale) {
  const auto place = [&](const tracking::PairReport::Track& track) {
    return cv::Point(static_cast<int>(std::lround((track.u + 0.5) * scale)),
                     static_cast<int>(std::lround((track.v + 0.5) * scale)));
  };
  for (const tracking::PairReport::Track& track : report.tracks)
    if (!track.inlier) {
      cv::drawMarker(canvas, place(track), kShadow, cv::MARKER_TILTED_CROSS, 9, 3, cv::LINE_AA);
      cv::drawMarker(canvas, place(track), kRejected, cv::MARKER_TILTED_CROSS, 8, 1, cv::LINE_AA);
    }
  for (const tracking::PairReport::Track& track : report.tracks)
    if (track.inlier) {
      cv::circle(canvas, place(track), 5, kShadow, cv::FILLED, cv::LINE_AA);
      cv::circle(canvas, place(track), 4, colour_of_age(track.age), cv::FILLED, cv::LINE_AA);
    }
}

void draw_identity(cv::Mat& canvas, const tracking::TrackedPair& pair) {
  char time[32];
  std::snprintf(time, sizeof time, "%.3f s", 1e-6 * static_cast<double>(pair.time_us));
  const std::string words = "pair " + std::to_string(pair.index) + "   " + pair.picture + "   " + time;
  darken(canvas, cv::Rect(6, 6, width_of(words, 0.45) + 16, 24));
  text(canvas, words, {14, 22}, kText, 0.45);
}

void draw_rotation(cv::Mat& canvas, const Matrix3& R_previous_this, int right) {
  constexpr int kRadius = 44, kMargin = 14;
  const cv::Point centre(right - kMargin - kRadius, kMargin + kRadius);
  darken(canvas, cv::Rect(centre.x - kRadius - 6, centre.y - kRadius - 6, 2 * kRadius + 12, 2 * kRadius + 34));

  const double roll = std::atan2(R_previous_this(1, 0), R_previous_this(0, 0));
  const double tilt = std::clamp(-kTiltFactor * roll, -1.2, 1.2);
  const cv::Point along(static_cast<int>(std::lround(kRadius * std::cos(tilt))),
                        static_cast<int>(std::lround(kRadius * std::sin(tilt))));
  cv::line(canvas, centre - along, centre + along, kDim, 1, cv::LINE_AA);
  cv::circle(canvas, centre, kRadius, kDim, 1, cv::LINE_AA);

  // Where the camera looks now, as seen from where it looked before.
  const Vector3 axis = R_previous_this.col(2);
  double x = kDegrees * std::atan2(axis.x(), axis.z()), y = kDegrees * std::atan2(axis.y(), axis.z());
  const double reach = std::max(1.0, std::hypot(x, y) / kFullTurn);
  const cv::Point tip(static_cast<int>(std::lround(kRadius * x / (reach * kFullTurn))),
                      static_cast<int>(std::lround(kRadius * y / (reach * kFullTurn))));
  if (const double length = std::hypot(tip.x, tip.y); length >= 4)
    cv::arrowedLine(canvas, centre, centre + tip, kWarning, 2, cv::LINE_AA, 0, std::min(0.5, 7 / length));
  cv::circle(canvas, centre, 2, kText, cv::FILLED, cv::LINE_AA);

  char words[32];
  std::snprintf(words, sizeof words, "%.1f deg", kDegrees * rotation_angle(R_previous_this));
  text(canvas, words, {centre.x - width_of(words, 0.45) / 2, centre.y + kRadius + 20}, kText, 0.45);
}

struct State {
  const char* words;
  cv::Scalar colour;
};

std::vector<State> states(const tracking::TrackedPair& pair) {
  const tracking::PairReport& report = pair.report;
  std::vector<State> all;
  if (report.repeated) return {{"the same picture again", kDim}};
  if (report.started_anew) all.push_back({"STARTED ANEW", kWarning});
  if (pair.keyframe) all.push_back({"KEYFRAME", kKeyframe});
  if (report.one_eye) all.push_back({"ONE EYE", kWarning});
  const bool first = pair.keyframe && pair.keyframe->source == MotionSource::kStart;
  if (!report.tracked && !report.started_anew && !first) all.push_back({"LOST: dead reckoning", kLost});
  return all;
}

void draw_bar(cv::Mat& bar, const tracking::TrackedPair& pair) {
  bar.setTo(kBarColour);
  const tracking::PairReport& report = pair.report;
  char words[128];
  std::snprintf(words, sizeof words, "%3d features   %3d inliers   %.2f px   %.1f m/s", report.found, report.inliers,
                report.rms_px, report.speed);
  constexpr int kBaseline = 29;
  text(bar, words, {14, kBaseline}, kText);
  int x = 14 + width_of(words) + 28;
  text(bar, "young", {x, kBaseline}, kDim, 0.42);
  x += width_of("young", 0.42) + 8;
  for (const int age : {0, 1, 2, 4, 8, kOldest}) {
    cv::circle(bar, {x + 4, kBaseline - 5}, 4, colour_of_age(age), cv::FILLED, cv::LINE_AA);
    x += 13;
  }
  text(bar, "old", {x + 4, kBaseline}, kDim, 0.42);
  int right = bar.cols - 14;
  for (const State& state : states(pair)) {
    right -= width_of(state.words);
    text(bar, state.words, {right, kBaseline}, state.colour);
    right -= 18;
  }
}

}  // namespace

ColourPicture draw_tracks(const tracking::TrackedPair& pair) {
  const vision::Image& picture = pair.pair->picture;
  const int scale = std::max(1, (kMinWidth + picture.width() - 1) / std::max(1, picture.width()));
  ColourPicture drawn;
  drawn.width = (scale * picture.width() + 1) / 2 * 2;
  drawn.height = (scale * picture.height() + kBar + 1) / 2 * 2;
  drawn.bgr.resize(static_cast<std::size_t>(drawn.width) * static_cast<std::size_t>(drawn.height) * 3);
  cv::Mat canvas(drawn.height, drawn.width, CV_8UC3, drawn.bgr.data());

  // OpenCV has no read-only views.
  const cv::Mat grey(picture.height(), picture.width(), CV_8U, const_cast<std::uint8_t*>(picture.row(0)));
  cv::Mat large, coloured;
  cv::resize(grey, large, {}, scale, scale, cv::INTER_LINEAR);
  cv::cvtColor(large, coloured, cv::COLOR_GRAY2BGR);
  cv::Mat view = canvas(cv::Rect(0, 0, large.cols, large.rows));
  coloured.convertTo(view, -1, 0.8);  // a little darker, so that the colours stand out

  if (!pair.report.repeated) draw_landmarks(view, pair.report, scale);
  draw_identity(view, pair);
  draw_rotation(view, pair.report.R_previous_this, view.cols);
  const auto special = states(pair);
  for (const State& state : special)
    if (state.colour == kLost || state.colour == kKeyframe)
      cv::rectangle(view, {1, 1}, {view.cols - 2, view.rows - 2}, state.colour, 3);
  cv::Mat bar = canvas(cv::Rect(0, large.rows, drawn.width, drawn.height - large.rows));
  draw_bar(bar, pair);
  return drawn;
}

}  // namespace relmap::frontend
