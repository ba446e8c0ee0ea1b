#include "frontend/run.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/imu_feed.h"
#include "frontend/pace.h"
#include "frontend/recording/keyframe_log.h"
#include "frontend/report_file.h"
#include "frontend/sink.h"
#include "frontend/track_show.h"
#include "frontend/tracking/pipeline.h"

namespace relmap {

namespace {

constexpr std::chrono::milliseconds kNewsSilence{500}, kNewsAtMost{10'000};
constexpr double kFilmRate = 10;  // pairs a second where no rate is asked for

bool is_stamp(Reason reason) { return reason == Reason::TIME_BACKWARDS || reason == Reason::TIME_AHEAD; }

class Run {
 public:
  Run(const RunOptions& options, const std::atomic<bool>& stop, RunSummary& summary)
      : options_(options), stop_(stop), summary_(summary), pace_(options.rate_hz) {}

  Status everything() {
    const bool is_log = options_.source == "log" || (options_.source == "auto" && is_event_log(options_.path));
    if (is_log) return replay_log();
    if (!options_.recorded.empty())
      return {Reason::INVALID_ARGUMENT, options_.path + " is no log: there is no session to choose"};
    return holds_keyframes() ? replay_file() : track();
  }

 private:
  // The next keyframe; nothing at the end.
  using NextKeyframe = std::function<Result<std::optional<Keyframe>>()>;

  std::string name_of_path() const {
    std::filesystem::path path = std::filesystem::path(options_.path).lexically_normal();
    if (path.filename().empty()) path = path.parent_path();
    return path.filename().string();
  }
  std::string keyframe_file() const {
    const std::filesystem::path path = options_.path;
    return std::filesystem::is_directory(path) ? (path / "keyframes.bin").string() : path.string();
  }
  bool holds_keyframes() const {
    return (options_.source == "sim" || options_.source == "auto") && is_keyframe_file(keyframe_file());
  }

  // `name`: of the session, unless it was said. `recording`: what tells its spool from those of others of that name.
  Status open_sink(const StereoCamera& camera, bool oneway, const std::string& name,
                   const std::string& recording = {}) {
    SessionHeader header;
    header.robot = options_.robot;
    header.name = options_.session.empty() ? name : options_.session;
    header.camera = camera;
    header.oneway = oneway || options_.oneway;
    if (!options_.uuid.empty()) header.uuid = *SessionUuid::parse(options_.uuid);
    PublisherOptions publisher = options_.publisher;
    publisher.live = options_.live;
    if (publisher.spool.empty()) publisher.spool = default_spool(header) + recording;
    auto sink = options_.to == "lcm" ? open_lcm_sink(publisher, header) : open_file_sink(options_.out, header);
    if (!sink.ok()) return sink.status();
    sink_ = std::move(*sink);
    watcher_ = std::jthread([sink = sink_.get(), &stop = stop_](const std::stop_token& done) {
      while (!done.stop_requested() && !stop) std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (stop) sink->interrupt();
    });
    sink_->hear([this](const PoseNews& news) {
      const auto recovery = localisation_.hear(news);
      if (recovery && !options_.quiet)
        std::fprintf(stderr, "keyframe %s found again, %.2f m from frame %s (unmeasured steps before it: %llu)\n",
                     recovery->keyframe.to_string().c_str(), recovery->distance_m, recovery->frame.to_string().c_str(),
                     static_cast<unsigned long long>(recovery->steps));
    });
    summary_.robot = sink_->session().robot;
    summary_.session = sink_->session().name;
    summary_.uuid = sink_->session().uuid.to_string();
    return {};
  }

  Status push(const Keyframe& keyframe) {
    localisation_.publishing(keyframe);  // before anybody can answer
    if (Status status = sink_->push(keyframe); !status.ok()) return status;
    ++summary_.keyframes;
    if (keyframe.source != MotionSource::kStart) {
      ++summary_.steps;
      summary_.metric_steps += is_vision(keyframe.source);
    }
    if (last_pose_) summary_.path_m += (keyframe.T_odom_frame.t - *last_pose_).norm();
    last_pose_ = keyframe.T_odom_frame.t;
    return {};
  }

  // A sink that was interrupted takes nothing more: the run goes on there the next time.
  bool was_interrupted(const Status& status) const { return stop_ && status.reason() == Reason::SHUTTING_DOWN; }

  Status finish() {
    auto published = sink_->finish(stop_ ? 0 : options_.patience_s);
    if (published.ok() && published->heard && published->all_settled()) await_news();
    watcher_ = {};
    sink_->hear({});
    summary_.recognised = localisation_.counts();
    summary_.place = localisation_.place();
    if (!published.ok()) return published.status();
    summary_.publishing = std::move(*published);
    return {};
  }

  // Keyframes are looked up after they are settled: until that has been silent for a while.
  void await_news() const {
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + kNewsAtMost;
    auto heard = localisation_.counts().heard;
    for (auto last = Clock::now(); !stop_ && Clock::now() < std::min(deadline, last + kNewsSilence);) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (const auto now = localisation_.counts().heard; std::exchange(heard, now) != now) last = Clock::now();
    }
  }

  Status replay_file() {
    auto file = KeyframeFileReader::open(keyframe_file());
    if (!file.ok()) return file.status();
    return replay(
        keyframe_file(), [&] { return file->next(); }, name_of_path());
  }

  Status replay_log() {
    auto log = KeyframeLog::open(options_.path, options_.recorded);
    if (!log.ok()) return log.status();
    const SessionHeader& recorded = log->session().header;
    Status status = replay(
        options_.path, [&] { return log->next(); }, recorded.name, "." + recorded.uuid.to_string());
    summary_.unreadable = log->left_out();
    return status;
  }

  // Keyframes that are ready made.
  Status replay(const std::string& path, const NextKeyframe& next, const std::string& name,
                const std::string& recording = {}) {
    if (!options_.report.empty() || !options_.show.empty())
      return {Reason::UNSUPPORTED, path + " holds keyframes: there are no pairs to report or to show"};
    auto keyframe = next();
    if (!keyframe.ok()) return keyframe.status();
    if (!keyframe->has_value()) return {Reason::BAD_SIZE, path + " holds no keyframe"};
    const SessionHeader& header = (*keyframe)->session;
    if (Status status = open_sink(header.camera, header.oneway, name, recording); !status.ok()) return status;
    const auto last = sink_->last_keyframe();
    ProgressLine progress(0, options_.quiet);
    for (; !stop_ && keyframe.ok() && keyframe->has_value(); keyframe = next()) {
      ++summary_.pairs;
      ++summary_.tracked;
      Keyframe& k = **keyframe;
      if (last && k.sequence <= last->sequence) continue;
      k.session = sink_->session();
      pace_.wait(stop_);
      if (Status status = push(k); was_interrupted(status))
        break;
      else if (!status.ok())
        return status;
      progress.show(summary_.pairs, summary_.keyframes, sink_->progress());
    }
    progress.end();
    if (Status status = finish(); !status.ok()) return status;
    return keyframe.status();
  }

  Result<std::optional<CapturedPair>> next_pair(StereoSource& source) {
    for (;;) {
      if (stop_) return std::optional<CapturedPair>();
      auto frame = source.next();
      if (!frame.ok()) return frame.status();
      if (!frame->has_value()) return std::optional<CapturedPair>();
      if (read_++ % options_.every != 0) continue;
      pace_.wait(stop_);
      StereoFrame& read = **frame;
      return std::optional(CapturedPair{std::move(read.left), std::move(read.right), read.time_us, read.eye_missing,
                                        read.index, std::move(read.picture)});
    }
  }

  // `goes_on`: what an interrupted run left is added to. The report, which may be emptied, comes last.
  Status open_reports(bool goes_on) {
    if (!options_.show.empty()) {
      auto show = open_track_show(options_.show, options_.rate_hz > 0 ? options_.rate_hz : kFilmRate, goes_on);
      if (!show.ok()) return show.status();
      show_ = std::move(*show);
    }
    if (!options_.report.empty()) {
      auto report = ReportFile::open(options_.report, goes_on);
      if (!report.ok()) return report.status();
      report_.emplace(std::move(*report));
    }
    return {};
  }

  Status close_reports() {
    Status report = report_ ? report_->close() : Status();
    Status show = show_ ? show_->close() : Status();
    return report.ok() ? show : report;
  }

  void count(const TrackedPair& pair) {
    const PairReport& report = pair.report;
    const bool first = summary_.pairs++ == 0;
    if (report.repeated)
      ++summary_.repeated;
    else if (report.tracked || first)
      ++summary_.tracked;
    else
      ++summary_.lost;
    summary_.one_eyed += report.one_eye && !report.repeated;
    summary_.tracking_ms += pair.tracking_ms;
    summary_.offset_px = report.offset_px;
  }

  Status track() {
    FolderOptions folder;
    folder.calibration = options_.calibration;
    auto opened = open_source(options_.source, options_.path, folder);
    if (!opened.ok()) return opened.status();
    StereoSource& source = **opened;
    if (!options_.quiet) std::fprintf(stderr, "%s\n", source.describe().c_str());
    if (Status status = check_stereo(source.camera()); !status.ok()) return status;
    auto imu = ImuFeed::open(options_.imu, source, options_.quiet);
    if (!imu.ok()) return imu.status();
    // Only a spool knows whether a run goes on; a file is emptied at once, so what else is written comes before it.
    const bool spooled = options_.to == "lcm";
    if (Status status = spooled ? Status() : open_reports(false); !status.ok()) return status;
    if (Status status = open_sink(source.camera(), false, name_of_path()); !status.ok()) return status;
    if (Status status = spooled ? open_reports(sink_->last_keyframe().has_value()) : Status(); !status.ok())
      return status;

    StereoTracker tracker(sink_->session());
    PipelineOptions pipeline_options;
    pipeline_options.drop_oldest = options_.live;
    if (options_.live) pipeline_options.waiting = 2;
    if (const auto last = sink_->last_keyframe()) {
      tracker.resume(*last);
      source.skip_before(last->time_us);
      pipeline_options.resumed_us = last->time_us;
    }
    PipelineStages stages;
    if (*imu) {
      tracker.use_imu((*imu)->calibration(), source.rectifier().left_rotation());
      stages.before_tracking = [&](StereoTracker& t, std::int64_t time_us) { t.feed((*imu)->until(time_us)); };
    }
    ProgressLine progress(source.count() / options_.every, options_.quiet);
    stages.capture = [&] { return next_pair(source); };
    stages.refused = [](const Status& status) { std::fprintf(stderr, "%s\n", status.to_string().c_str()); };
    stages.publish = [&](TrackedPair& pair) -> Status {
      count(pair);
      if (report_) report_->add(pair);
      if (pair.keyframe)
        if (Status status = push(*pair.keyframe); !status.ok()) return status;
      if (show_)
        if (Status status = show_->show(draw_tracks(pair), pair.index); !status.ok()) return status;
      progress.show(summary_.pairs, summary_.keyframes, sink_->progress());
      return {};
    };
    Pipeline pipeline(tracker, source.rectifier(), std::move(stages), pipeline_options);
    const Status status = pipeline.run();
    progress.end();
    take(pipeline.summary());
    const Status closed = close_reports();
    if (!status.ok() && !was_interrupted(status)) return status;
    if (Status finished = finish(); !finished.ok()) return finished;
    return closed;
  }

  void take(const PipelineSummary& summary) {
    summary_.dropped = summary.dropped;
    for (const auto& [reason, count] : summary.refused)
      (is_stamp(reason) ? summary_.stamps_refused : summary_.unreadable)[reason] += count;
    summary_.latency_p50_ms = summary.latency_ms(0.5);
    summary_.latency_p99_ms = summary.latency_ms(0.99);
  }

  const RunOptions& options_;
  const std::atomic<bool>& stop_;
  RunSummary& summary_;
  Pace pace_;
  std::size_t read_ = 0;
  Localisation localisation_;
  std::unique_ptr<KeyframeSink> sink_;
  std::jthread watcher_;
  std::optional<ReportFile> report_;
  std::unique_ptr<TrackShow> show_;
  std::optional<Vector3> last_pose_;
};

}  // namespace

Status run_frontend(const RunOptions& options, const std::atomic<bool>& stop, RunSummary& summary) {
  const auto begin = std::chrono::steady_clock::now();
  Status status = Run(options, stop, summary).everything();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  summary.interrupted = stop;
  return status;
}

}  // namespace relmap
