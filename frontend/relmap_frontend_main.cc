// relmap-frontend: stereo pictures in, keyframes out.
#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/console.h"
#include "frontend/sink.h"
#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/tracker.h"

namespace relmap {
namespace {

enum ExitCode { kDone = 0, kFailed = 1, kUsage = 2, kUnsettled = 3, kInterrupted = 4 };

std::atomic<bool> g_stop = false;
void on_signal(int) { g_stop = true; }

struct Arguments {
  std::string source, path, robot, session, uuid, calibration, to = "lcm", out, rate = "max";
  PublisherOptions publisher;
  double patience_s = 60;
  std::size_t every = 1;
  bool oneway = false, json = false, quiet = false;
};

// Waits so that items leave at the rate asked for; no rate: as fast as they come.
class Pace {
 public:
  explicit Pace(double hz) : hz_(hz), begin_(std::chrono::steady_clock::now()) {}
  void wait() {
    if (hz_ <= 0) return;
    const auto due = begin_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                  std::chrono::duration<double>(static_cast<double>(count_++) / hz_));
    while (!g_stop && std::chrono::steady_clock::now() < due)
      std::this_thread::sleep_until(std::min(due, std::chrono::steady_clock::now() + std::chrono::milliseconds(100)));
  }

 private:
  double hz_;
  std::chrono::steady_clock::time_point begin_;
  std::uint64_t count_ = 0;
};

class Run {
 public:
  Run(const Arguments& arguments, double hz) : arguments_(arguments), pace_(hz) {}

  Status everything() {
    begin_ = std::chrono::steady_clock::now();
    const Status status = is_keyframe_file() ? replay() : track();
    summary_.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    summary_.interrupted = g_stop;
    return status;
  }
  const RunSummary& summary() const { return summary_; }

 private:
  std::string keyframe_file() const {
    const std::filesystem::path path = arguments_.path;
    return std::filesystem::is_directory(path) ? (path / "keyframes.bin").string() : path.string();
  }
  bool is_keyframe_file() const {
    return arguments_.source == "sim" && std::filesystem::is_regular_file(keyframe_file());
  }

  Status open_sink(const StereoCamera& camera, bool oneway) {
    SessionHeader header;
    header.robot = arguments_.robot;
    header.name = arguments_.session;
    header.camera = camera;
    header.oneway = oneway || arguments_.oneway;
    if (!arguments_.uuid.empty()) header.uuid = *SessionUuid::parse(arguments_.uuid);
    auto options = arguments_.publisher;
    if (options.spool.empty()) options.spool = default_spool(header);
    auto sink = arguments_.to == "lcm" ? open_lcm_sink(options, header) : open_file_sink(arguments_.out, header);
    if (!sink.ok()) return sink.status();
    sink_ = std::move(*sink);
    watcher_ = std::jthread([sink = sink_.get()](const std::stop_token& done) {
      while (!done.stop_requested() && !g_stop) std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (g_stop) sink->interrupt();
    });
    summary_.robot = sink_->session().robot;
    summary_.session = sink_->session().name;
    summary_.uuid = sink_->session().uuid.to_string();
    return {};
  }

  Status push(const Keyframe& keyframe) {
    if (Status status = sink_->push(keyframe); !status.ok()) return g_stop ? Status() : status;
    ++summary_.keyframes;
    if (keyframe.source != MotionSource::kStart) {
      ++summary_.steps;
      summary_.metric_steps += is_vision(keyframe.source);
    }
    if (last_pose_) summary_.path_m += (keyframe.T_odom_frame.t - *last_pose_).norm();
    last_pose_ = keyframe.T_odom_frame.t;
    return {};
  }

  Status finish() {
    auto published = sink_->finish(g_stop ? 0 : arguments_.patience_s);
    watcher_ = {};
    if (!published.ok()) return published.status();
    summary_.publishing = std::move(*published);
    return {};
  }

  // Keyframes that are ready made.
  Status replay() {
    auto file = KeyframeFileReader::open(keyframe_file());
    if (!file.ok()) return file.status();
    auto keyframe = file->next();
    if (!keyframe.ok()) return keyframe.status();
    if (!keyframe->has_value()) return {Reason::BAD_SIZE, keyframe_file() + " holds no keyframe"};
    if (Status status = open_sink((*keyframe)->session.camera, (*keyframe)->session.oneway); !status.ok())
      return status;
    const auto last = sink_->last_keyframe();
    ProgressLine progress(0, arguments_.quiet);
    for (; !g_stop && keyframe.ok() && keyframe->has_value(); keyframe = file->next()) {
      ++summary_.pairs;
      ++summary_.tracked;
      Keyframe& k = **keyframe;
      if (last && k.sequence <= last->sequence) continue;
      k.session = sink_->session();
      pace_.wait();
      if (Status status = push(k); !status.ok()) return status;
      progress.show(summary_.pairs, summary_.keyframes, sink_->progress());
    }
    progress.end();
    if (Status status = finish(); !status.ok()) return status;
    return keyframe.status();
  }

  Status track() {
    FolderOptions options;
    options.calibration = arguments_.calibration;
    auto source =
        arguments_.source == "images" ? open_images(arguments_.path, options) : open_kitti(arguments_.path, options);
    if (!source.ok()) return source.status();
    if (!arguments_.quiet) std::fprintf(stderr, "%s\n", (*source)->describe().c_str());
    if (Status status = open_sink((*source)->camera(), false); !status.ok()) return status;

    StereoTracker tracker(sink_->session());
    if (const auto last = sink_->last_keyframe()) {
      tracker.resume(*last);
      (*source)->skip_before(last->time_us);
    }
    ProgressLine progress((*source)->count() / arguments_.every, arguments_.quiet);
    for (std::size_t i = 0; !g_stop; ++i) {
      auto frame = (*source)->next();
      if (!frame.ok()) {
        ++summary_.unreadable[frame.reason()];
        std::fprintf(stderr, "%s\n", frame.status().to_string().c_str());
        continue;
      }
      if (!frame->has_value()) break;
      if (i % arguments_.every != 0) continue;
      pace_.wait();
      const auto start = std::chrono::steady_clock::now();
      const auto pictures = rectify((*source)->rectifier(), std::move(**frame)).or_throw();
      const auto pair = prepare_pair(pictures.left, pictures.right);
      auto keyframe = tracker.feed(pair, pictures.time_us);
      if (keyframe.ok() && *keyframe) {
        (*keyframe)->appearance = appearance_set(*pair, **keyframe, 300);
        (*keyframe)->thumbnail = make_thumbnail(pair->picture);
      }
      summary_.tracking_ms +=
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
      if (!keyframe.ok()) return keyframe.status();
      ++summary_.pairs;
      summary_.tracked += tracker.report().tracked || (*keyframe && (*keyframe)->source == MotionSource::kStart);
      if (*keyframe)
        if (Status status = push(**keyframe); !status.ok()) return status;
      progress.show(summary_.pairs, summary_.keyframes, sink_->progress());
    }
    progress.end();
    return finish();
  }

  const Arguments& arguments_;
  Pace pace_;
  std::chrono::steady_clock::time_point begin_;
  std::unique_ptr<KeyframeSink> sink_;
  std::jthread watcher_;
  std::optional<Vector3> last_pose_;
  RunSummary summary_;
};

constexpr const char* kFooter =
    "Examples:\n"
    "  relmap-frontend --source kitti ~/kitti/06 --robot car --to lcm --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
    "  relmap-frontend --source images ~/euroc/V1_01 --robot drone --session morning\n"
    "  relmap-frontend --source images pairs/ --calibration stereo.yaml --robot cart --rate 10\n"
    "  relmap-frontend --source sim drive/ --robot sim --to file --out keyframes.bin\n"
    "\n"
    "Sources: kitti (image_0, image_1, calib.txt, times.txt), images (left and right, cam0 and cam1, ...; with\n"
    "--calibration or one in the folder), sim (a folder written by relmap-sim: pictures, or keyframes.bin).\n"
    "Keyframes that relmapd has not settled stay in the spool; the same command goes on where it stopped.\n"
    "\n"
    "Exit codes: 0 everything settled, 1 failed (the reason is printed), 2 wrong usage, 3 keyframes left unsettled\n"
    "or refused, 4 interrupted.";

int main_function(int argc, char** argv) {
  Arguments a;
  CLI::App app("Stereo pictures in, keyframes of a relative map out.", "relmap-frontend");
  app.footer(kFooter);
  app.add_option("--source", a.source, "where pairs come from")
      ->required()
      ->check(CLI::IsMember({"kitti", "images", "sim"}));
  app.add_option("path", a.path, "the source's folder or file")->required();
  app.add_option("--robot", a.robot, "name of the robot")->required();
  app.add_option("--session", a.session, "name of the session (default: the folder's name)");
  app.add_option("--uuid", a.uuid, "identity of a new session (default: random)")->check([](const std::string& text) {
    return SessionUuid::parse(text) ? "" : "not a uuid: " + text;
  });
  app.add_option("--calibration", a.calibration, "KITTI, OpenCV or EuRoC file, or a folder with one");
  app.add_option("--to", a.to, "where keyframes go")->check(CLI::IsMember({"lcm", "file"}))->capture_default_str();
  app.add_option("--lcm", a.publisher.lcm_url, "LCM URL")->capture_default_str();
  app.add_option("--spool", a.publisher.spool, "folder that keeps keyframes until they are settled (--to lcm)");
  app.add_option("--out", a.out, "the file (--to file)");
  app.add_option("--rate", a.rate, "pairs a second, or max")->capture_default_str();
  app.add_option("--every", a.every, "use every n-th pair")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--patience", a.patience_s, "seconds without progress before giving up on a silent daemon")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  app.add_flag("--oneway", a.oneway, "the session may be travelled only in the direction driven");
  app.add_flag("--json", a.json, "the summary as JSON on standard output");
  app.add_flag("--quiet", a.quiet, "no progress");
  double hz = 0;
  try {
    app.parse(argc, argv);
    if (a.rate != "max") {
      if (!CLI::detail::lexical_cast(a.rate, hz) || !(hz > 0))
        throw CLI::ValidationError("--rate", "neither a number of pairs a second nor max: " + a.rate);
    }
    if (a.to == "file" && a.out.empty()) throw CLI::RequiredError("--out");
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (a.session.empty()) {
    std::filesystem::path path = std::filesystem::path(a.path).lexically_normal();
    if (path.filename().empty()) path = path.parent_path();
    a.session = path.filename().string();
  }
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  Run run(a, hz);
  const Status status = run.everything();
  const RunSummary& summary = run.summary();
  if (!status.ok()) std::fprintf(stderr, "relmap-frontend: %s\n", status.to_string().c_str());
  if (a.json)
    std::printf("%s\n", summary_json(summary).c_str());
  else if (status.ok())
    std::fputs(summary_text(summary).c_str(), stdout);
  if (!status.ok()) return kFailed;
  if (summary.interrupted) return kInterrupted;
  return summary.publishing.all_settled() && summary.publishing.refused.empty() ? kDone : kUnsettled;
}

}  // namespace
}  // namespace relmap

int main(int argc, char** argv) {
  try {
    return relmap::main_function(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "relmap-frontend: %s\n", error.what());
    return relmap::kFailed;
  }
}
