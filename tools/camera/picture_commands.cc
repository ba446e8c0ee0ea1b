// show and check: pictures of a camera or a recording.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "frontend/vision/rectify.h"
#include "frontend/vision/rig_check.h"
#include "proto/base/json.h"
#include "tools/camera/commands.h"
#include "tools/terminal/progress_bar.h"

namespace relmap::camera {

namespace {

constexpr int kRowsBetweenLines = 32;

// Gives up a stream that has delivered no pair for kPatience, with the reason.
class Patience {
 public:
  void had_one() { until_ = Clock::now() + kPatience; }
  // There was no pair. Ok while patience is left, else why the stream is given up.
  Status without(const Status& why) {
    if (!why.ok()) why_ = why;
    if (Clock::now() < until_) return {};
    const std::string text = "no pair within " + std::to_string(kPatience.count()) + " s";
    return why_.ok() ? Status(Reason::CAMERA_SILENT, text) : Status(why_.reason(), text + ": " + why_.message());
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPatience{10};
  Clock::time_point until_ = Clock::now() + kPatience;
  Status why_;
};

// Rectifies the frame in place, if there is a rectifier.
Status rectify(const std::optional<vision::Rectifier>& rectifier, capture::StereoFrame& frame) {
  if (!rectifier) return {};
  auto rectified = relmap::capture::rectify(*rectifier, std::move(frame));
  if (!rectified.ok()) return rectified.status();
  frame = std::move(*rectified);
  return {};
}

struct ShowOptions {
  std::string camera, out = ".", calibration;
  int count = 1;
  int skip = 0;
  bool raw = false;
};

cv::Mat view_of(const vision::Image& picture) {
  return cv::Mat(picture.height(), picture.width(), CV_8UC1, const_cast<std::uint8_t*>(picture.row(0)));
}

// Both eyes side by side. `lines` draws lines along rows: on one row, rectified eyes show the same things.
cv::Mat side_by_side(const capture::StereoFrame& frame, bool lines) {
  cv::Mat both, coloured;
  cv::hconcat(view_of(frame.left), view_of(frame.right), both);
  cv::cvtColor(both, coloured, cv::COLOR_GRAY2BGR);
  if (lines)
    for (int y = kRowsBetweenLines / 2; y < coloured.rows; y += kRowsBetweenLines)
      cv::line(coloured, {0, y}, {coloured.cols - 1, y}, {90, 200, 90}, 1);
  cv::line(coloured, {frame.left.width(), 0}, {frame.left.width(), coloured.rows - 1}, {40, 40, 40}, 1);
  return coloured;
}

Result<ExitCode> show(const GlobalOptions& options, terminal::Console& console, const ShowOptions& wish) {
  auto stream = open_pairs(options, wish.camera, wish.calibration, 0);
  if (!stream.ok()) return stream.status();
  if (!options.quiet) console.err() << (*stream)->describe() << '\n';
  std::optional<vision::Rectifier> rectifier;
  if (!wish.raw) {
    const auto calibration = (*stream)->calibration();
    if (calibration.ok()) {
      auto made = vision::Rectifier::make(*calibration, calibration->width, calibration->height);
      if (!made.ok()) return made.status();
      rectifier = std::move(*made);
    } else if (calibration.reason() == Reason::NO_CALIBRATION) {
      console.err() << calibration.status().message() << "; the pictures are not rectified\n";
    } else {
      return calibration.status();
    }
  }
  std::error_code error;
  std::filesystem::create_directories(wish.out, error);
  if (!std::filesystem::is_directory(wish.out, error))
    return {Reason::IO_ERROR, wish.out + " is no folder and cannot be created"};
  Patience patience;
  for (int shown = 0, seen = 0; shown < wish.count;) {
    auto next = (*stream)->next();
    if (!next.ok()) {
      console.err() << next.status().to_string() << '\n';
      if (Status over = patience.without(next.status()); !over.ok()) return over;
      continue;
    }
    patience.had_one();
    if (!next->has_value()) return stop_flag() ? kInterrupted : kOk;
    if (seen++ < wish.skip) continue;
    capture::StereoFrame frame = std::move(**next);
    if (frame.left.empty() || frame.right.empty()) continue;
    if (Status status = rectify(rectifier, frame); !status.ok()) return status;
    char name[32];
    std::snprintf(name, sizeof name, "%06llu.png", static_cast<unsigned long long>(frame.index));
    const std::string path = (std::filesystem::path(wish.out) / name).string();
    if (!cv::imwrite(path, side_by_side(frame, rectifier.has_value())))
      return {Reason::IO_ERROR, "cannot write " + path};
    if (options.json)
      console.reply(Json().add("file", path).add("time", terminal::time_text(frame.time_us)).text());
    else
      console.out() << path << '\n';
    ++shown;
  }
  return kOk;
}

struct CheckOptions {
  std::string camera, calibration;
  int pairs = 30;
  bool raw = false;
};

std::string percent(double share) { return terminal::fixed(100 * share, 1) + " %"; }
std::string pixels(std::optional<double> value) { return value ? terminal::fixed(*value, 2) + " px" : "not known"; }

Json json_of(const vision::EyeReport& eye) {
  Json json;
  json.add("mean", eye.mean).add("deviation", eye.deviation).add("saturated", eye.saturated).add("black", eye.black);
  if (eye.edge_width) json.add("edge_width_px", *eye.edge_width);
  return json;
}

void print(const vision::RigReport& report, bool rectified, terminal::Console& console) {
  const auto eye = [&](const char* name, const vision::EyeReport& of) {
    return std::vector<std::string>{name,
                                    terminal::fixed(of.mean, 0),
                                    terminal::fixed(of.deviation, 0),
                                    percent(of.saturated),
                                    percent(of.black),
                                    pixels(of.edge_width)};
  };
  console.table({"eye", ">grey", ">spread", ">saturated", ">black", ">edges"},
                {eye("left", report.left), eye("right", report.right)});
  console.out() << '\n';
  std::vector<std::pair<std::string, std::string>> facts = {
      {"pairs", std::to_string(report.pairs)}, {"points that both eyes see", std::to_string(report.matches)}};
  if (report.matches > 0) {
    if (rectified) {
      facts.push_back({"row error", terminal::fixed(report.row_error, 2) + " px (median), " +
                                        terminal::fixed(report.row_error_90, 2) + " px (90 %)"});
      facts.push_back({"its trend", terminal::fixed(report.row_offset, 2) + " px in the middle, " +
                                        terminal::fixed(report.row_slope_x, 2) + " px across, " +
                                        terminal::fixed(report.row_slope_y, 2) + " px down"});
    }
    facts.push_back({"disparity", terminal::fixed(report.disparity, 1) + " px (median), " +
                                      percent(report.positive_disparity) + " positive"});
  }
  console.facts(facts);
  for (const Status& finding : report.findings)
    console.out() << finding.to_string() << "\n  what helps: " << vision::rig_advice(finding.reason()) << '\n';
  if (report.findings.empty()) console.out() << "all is well\n";
}

Result<ExitCode> check(const GlobalOptions& options, terminal::Console& console, const CheckOptions& wish) {
  auto stream = open_pairs(options, wish.camera, wish.calibration, 0);
  if (!stream.ok()) return stream.status();
  if (!options.quiet) console.err() << (*stream)->describe() << '\n';
  std::optional<vision::Rectifier> rectifier;
  if (!wish.raw) {
    const auto calibration = (*stream)->calibration();
    if (calibration.reason() == Reason::NO_CALIBRATION)
      return {Reason::NO_CALIBRATION,
              calibration.status().message() + "; --raw checks focus, exposure and the eyes without one"};
    if (!calibration.ok()) return calibration.status();
    auto made = vision::Rectifier::make(*calibration, calibration->width, calibration->height);
    if (!made.ok()) return made.status();
    rectifier = std::move(*made);
  }
  vision::RigCheck rig(rectifier ? std::optional(rectifier->camera()) : std::nullopt);
  terminal::ProgressBar bar(console.err(), terminal::is_terminal());
  Patience patience;
  for (int seen = 0; seen < wish.pairs;) {
    auto next = (*stream)->next();
    if (!next.ok()) {
      bar.end();
      console.err() << next.status().to_string() << '\n';
      if (Status over = patience.without(next.status()); !over.ok()) return over;
      continue;
    }
    patience.had_one();
    if (!next->has_value()) {
      if (stop_flag()) return kInterrupted;
      break;
    }
    capture::StereoFrame frame = std::move(**next);
    if (Status status = rectify(rectifier, frame); !status.ok()) return status;
    if (frame.left.empty() || frame.right.empty()) continue;
    if (Status status = rig.add(frame.left, frame.right); !status.ok()) return status;
    if (!options.quiet)
      bar.show("looking", static_cast<std::uint64_t>(++seen), static_cast<std::uint64_t>(wish.pairs), "pairs");
    else
      ++seen;
  }
  bar.end();
  vision::RigReport report = rig.report();
  // Pictures that are not rectified need not agree in their rows.
  if (wish.raw)
    std::erase_if(report.findings, [](const Status& finding) { return finding.reason() == Reason::ROWS_APART; });
  if (options.json) {
    std::vector<Json> findings;
    for (const Status& finding : report.findings)
      findings.push_back(Json()
                             .add("reason", reason_name(finding.reason()))
                             .add("message", finding.message())
                             .add("advice", vision::rig_advice(finding.reason())));
    console.reply(Json()
                      .add("pairs", std::uint64_t(report.pairs))
                      .add("matches", std::uint64_t(report.matches))
                      .add("rectified", !wish.raw)
                      .add("row_error_px", report.row_error)
                      .add("row_error_90_px", report.row_error_90)
                      .add("row_offset_px", report.row_offset)
                      .add("row_slope_x_px", report.row_slope_x)
                      .add("row_slope_y_px", report.row_slope_y)
                      .add("disparity_px", report.disparity)
                      .add("positive_disparity", report.positive_disparity)
                      .add("left", json_of(report.left))
                      .add("right", json_of(report.right))
                      .add("findings", findings)
                      .text());
  } else {
    print(report, !wish.raw, console);
  }
  return report.findings.empty() ? kOk : kFindings;
}

}  // namespace

void add_show(CLI::App& app, Action& action) {
  auto* const command = app.add_subcommand("show", "write pictures of both eyes, side by side, as PNG files");
  command->footer("Example:\n  relmap-camera show 7140058 --out pictures/ --count 5");
  auto wish = std::make_shared<ShowOptions>();
  command->add_option("CAMERA", wish->camera, "serial number or GUID, or a recording")->type_name("CAMERA|FILE");
  command
      ->add_option("--out", wish->out,
                   "folder for the pictures; created if it does not exist (default: the current one)")
      ->type_name("FOLDER");
  command->add_option("--count", wish->count, "number of pairs")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--skip", wish->skip, "skip so many pairs before the first")
      ->check(CLI::Range(0, 100'000'000))
      ->capture_default_str();
  command
      ->add_option("--calibration", wish->calibration,
                   "calibration file or folder, instead of the one kept by serial number")
      ->type_name("FILE|FOLDER");
  command->add_flag("--raw", wish->raw, "do not rectify the pictures");
  command->callback([&action, wish] {
    action = [wish](const GlobalOptions& options, terminal::Console& console) { return show(options, console, *wish); };
  });
}

void add_check(CLI::App& app, Action& action) {
  auto* const command = app.add_subcommand(
      "check", "check row error, order of the eyes, focus and exposure; point the camera at something with texture");
  command->footer("Examples:\n  relmap-camera check 7140058\n  relmap-camera check drive.raw");
  auto wish = std::make_shared<CheckOptions>();
  command->add_option("CAMERA", wish->camera, "serial number or GUID, or a recording")->type_name("CAMERA|FILE");
  command->add_option("--pairs", wish->pairs, "number of pairs to check")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  command
      ->add_option("--calibration", wish->calibration,
                   "calibration file or folder, instead of the one kept by serial number")
      ->type_name("FILE|FOLDER");
  command->add_flag("--raw", wish->raw, "check without a calibration; row errors are not measured");
  command->callback([&action, wish] {
    action = [wish](const GlobalOptions& options, terminal::Console& console) {
      return check(options, console, *wish);
    };
  });
}

}  // namespace relmap::camera
