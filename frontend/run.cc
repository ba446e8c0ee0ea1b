#include "frontend/run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "frontend/capture/dc1394/camera_buses.h"
#include "frontend/capture/first_pairs.h"
#include "frontend/capture/iidc/iidc_source.h"
#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/photograph_folder.h"
#include "frontend/capture/recording_identity.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/imu_feed.h"
#include "frontend/pace.h"
#include "frontend/picture_report.h"
#include "frontend/recording/keyframe_log.h"
#include "frontend/report_file.h"
#include "frontend/rig_watch.h"
#include "frontend/sink.h"
#include "frontend/track_show.h"
#include "frontend/tracking/mono_keyframes.h"
#include "frontend/tracking/pipeline.h"
#include "proto/base/names.h"

namespace relmap::frontend {

namespace {

constexpr std::chrono::milliseconds kNewsSilence{500}, kNewsAtMost{10'000};
constexpr std::chrono::seconds kSilence{5};
constexpr std::chrono::milliseconds kLook{50}, kCameraWait{1000};
constexpr std::chrono::seconds kSlowedAtMost{15};  // without being told again
constexpr double kMapPatience = 5;                 // s, for a daemon to say which map it serves
constexpr double kEndPatience = 2;                 // s, for word that the end of a session is noted
constexpr std::size_t kMaxNamed = 100'000;         // pictures left out of a recording
constexpr double kFilmRate = 10;                   // pairs a second where no rate is asked for
constexpr std::size_t kMaxHeldBack = 256;          // keyframes, till two pairs hang together

// Of a camera that was not there when it was looked for.
bool may_come(Reason reason) {
  return reason == Reason::NO_CAMERA || reason == Reason::CAMERA_GONE || reason == Reason::CAMERA_BUSY ||
         reason == Reason::CAMERA_FORBIDDEN;
}

bool is_log(const RunOptions& options) {
  return options.source == "log" || (options.source == "auto" && recording::is_event_log(options.path));
}

std::string keyframe_file(const RunOptions& options) {
  const std::filesystem::path path = options.path;
  return std::filesystem::is_directory(path) ? (path / "keyframes.bin").string() : path.string();
}

bool holds_keyframes(const RunOptions& options) {
  return (options.source == "sim" || options.source == "auto") && capture::is_keyframe_file(keyframe_file(options));
}

bool is_stamp(Reason reason) { return reason == Reason::TIME_BACKWARDS || reason == Reason::TIME_AHEAD; }

class Run {
 public:
  Run(const RunOptions& options, const std::atomic<bool>& stop, RunSummary& summary)
      : options_(options),
        stop_(stop),
        summary_(summary),
        pace_(is_camera() ? 0 : options.rate_hz),
        refusals_(is_camera() ? 0 : kMaxNamed) {}

  Status everything() {
    const Status status = take_in();
    summary_.left_out = refusals_.all();
    return status;
  }

 private:
  Status take_in() {
    if (Status status = check_outputs(); !status.ok()) return status;
    if (options_.mono) return take_pictures();
    if (is_log(options_)) return replay_log();
    if (!options_.recorded.empty())
      return {Reason::INVALID_ARGUMENT, options_.path + " is no log: there is no session to choose"};
    return holds_keyframes(options_) ? replay_file() : track();
  }

  bool is_camera() const { return options_.source == "iidc"; }

  // The next keyframe; nothing at the end.
  using NextKeyframe = std::function<Result<std::optional<Keyframe>>()>;

  std::string name_of_path() const {
    std::filesystem::path path = std::filesystem::path(options_.path).lexically_normal();
    if (path.filename().empty()) path = path.parent_path();
    return path.filename().string();
  }

  // Nothing is written over what it is made from, nor over something else that is written.
  Status check_outputs() const {
    const auto same = [](const std::string& a, const std::string& b) {
      std::error_code error;
      return !a.empty() && !b.empty() &&
             (std::filesystem::equivalent(a, b, error) ||
              std::filesystem::weakly_canonical(a, error) == std::filesystem::weakly_canonical(b, error));
    };
    const std::string* const outputs[] = {&options_.out, &options_.report, &options_.show};
    for (const std::string* output : outputs) {
      for (const std::string& input : {options_.path, keyframe_file(options_), options_.calibration, options_.imu})
        if (same(*output, input)) return {Reason::INVALID_ARGUMENT, *output + " would be written over the source"};
      for (const std::string* other : outputs)
        if (other != output && same(*output, *other))
          return {Reason::INVALID_ARGUMENT, *output + " is to be written twice"};
    }
    return {};
  }

  // `session`: its names hold where others are not asked for. `recording`: what it is made of (DiskSpool::open()).
  Status open_sink(const SessionHeader& session, const std::string& recording, const std::string& spool_suffix = {}) {
    SessionHeader header = session;
    if (!options_.robot.empty()) header.robot = options_.robot;
    if (!options_.session.empty()) header.name = options_.session;
    if (header.robot.empty()) return {Reason::INVALID_ARGUMENT, "the robot has no name: --robot gives it one"};
    if (Status status = check_name("--robot", header.robot); !status.ok()) return status;
    if (Status status = check_name("--session", header.name); !status.ok()) return status;
    header.oneway |= options_.oneway;
    if (!options_.as_recorded) header.uuid = options_.uuid.empty() ? SessionUuid() : *SessionUuid::parse(options_.uuid);
    publishing::PublisherOptions publisher = options_.publisher;
    publisher.live = options_.live;
    publisher.recording = recording;
    if (options_.all_keyframes) publisher.recording += ", all keyframes";
    // Whole ones, the default, are not named.
    if (options_.picture == tracking::KeyframePicture::kSmall) publisher.recording += ", small pictures";
    if (options_.picture == tracking::KeyframePicture::kNone) publisher.recording += ", no pictures";
    if (options_.every > 1) publisher.recording += ", every " + std::to_string(options_.every);
    if (publisher.spool.empty()) publisher.spool = default_spool(header) + spool_suffix;
    if (sends() && !publisher.in_memory) summary_.spool = publisher.spool;
    if (publisher.in_memory) publisher.patience = std::chrono::milliseconds(std::llround(1e3 * options_.patience_s));
    if (Status status = open_sink_in_its_map(publisher, header); !status.ok()) return status;
    watcher_ = std::jthread([this](const std::stop_token& done) { watch(done); });
    sink_->hear([this](const PoseNews& news) {
      take_pace(news);
      const auto recovery = localisation_.hear(news);
      if (recovery && !options_.quiet)
        std::fprintf(stderr, "keyframe %s found again, %.2f m from frame %s (unmeasured steps before it: %llu)\n",
                     recovery->keyframe.to_string().c_str(), recovery->distance_m, recovery->frame.to_string().c_str(),
                     static_cast<unsigned long long>(recovery->steps));
    });
    summary_.robot = sink_->session().robot;
    summary_.session = sink_->session().name;
    summary_.uuid = sink_->session().uuid.to_string();
    if (const auto last = sink_->last_keyframe()) {
      summary_.gone_on = last->sequence;
      if (!options_.quiet)
        std::fprintf(stderr, "session %s goes on after keyframe %u, kept in %s\n", summary_.session.c_str(),
                     last->sequence, summary_.spool.c_str());
    }
    return {};
  }

  // Not longer than the run is wanted.
  Status await_map() {
    const std::jthread watcher([this](const std::stop_token& done) {
      while (!done.stop_requested() && !stop_) std::this_thread::sleep_for(kLook);
      if (stop_) sink_->interrupt();
    });
    return sink_->await_map(kMapPatience);
  }

  // A recording that was begun in another map than the daemon's, or in one that has lost what came after a backup, is
  // published to it from its beginning.
  Status open_sink_in_its_map(publishing::PublisherOptions publisher, const SessionHeader& header) {
    for (;;) {
      auto sink = options_.to == "lcm"    ? open_lcm_sink(publisher, header)
                  : options_.to == "grpc" ? open_grpc_sink(options_.server, publisher, header)
                                          : open_file_sink(options_.out, header);
      if (!sink.ok()) return sink.status();
      sink_ = std::move(*sink);
      if (publisher.begin_anew || !publisher.repeatable()) return {};
      const Status map = await_map();
      if (map.ok() || stop_) return {};
      std::fprintf(stderr, "%s: the recording is sent to it from its beginning\n", map.message().c_str());
      sink_.reset();
      publisher.begin_anew = true;
    }
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

  // A session begins with its first keyframe, and would stay in the map: of a recording of which no pair follows from
  // another none is sent.
  Status push_once_tracked(Keyframe keyframe) {
    if (summary_.tracked > 1) {
      if (Status status = push_held_back(); !status.ok()) return status;
      return push(keyframe);
    }
    held_back_.push_back(std::move(keyframe));
    return held_back_.size() < kMaxHeldBack ? Status() : untracked("none of the first ");
  }
  Status push_held_back() {
    for (const Keyframe& keyframe : std::exchange(held_back_, {}))
      if (Status status = push(keyframe); !status.ok()) return status;
    return {};
  }

  bool sends() const { return options_.to != "file"; }
  const std::string& daemon() const { return options_.to == "grpc" ? options_.server : options_.publisher.lcm_url; }

  // What the daemon asks for, by a thread of the transport's.
  void take_pace(const PoseNews& news) {
    if (news.kind == PoseNews::Kind::kSlowDown) slowed_at_ = std::chrono::steady_clock::now();
    if (news.kind == PoseNews::Kind::kSlowDown && wanted_hz_.exchange(news.rate_hz) == 0) {
      ++slow_downs_;
      if (!options_.quiet) std::fprintf(stderr, "the daemon asks for at most %g keyframes/s\n", news.rate_hz);
    }
    if (news.kind == PoseNews::Kind::kResume && wanted_hz_.exchange(0) != 0 && !options_.quiet)
      std::fputs("the daemon takes keyframes at any rate again\n", stderr);
  }

  // Tells the sink when the run is to stop, and the user when no daemon listens.
  void watch(const std::stop_token& done) {
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> silent_since = begin_;
    bool told = false;
    for (; !done.stop_requested() && !stop_; std::this_thread::sleep_for(kLook)) {
      if (!sends()) continue;
      // It is said again while it holds; that it holds no more is said once, and may be lost.
      if (wanted_hz_ != 0 && Clock::now() - slowed_at_.load() > kSlowedAtMost) wanted_hz_ = 0;
      const Status trouble = sink_->trouble();
      const bool wrong_map = options_.live && trouble.reason() == Reason::WRONG_MAP;
      if (sink_->progress().heard && trouble.ok()) {
        if (std::exchange(told, false)) std::fprintf(stderr, "relmapd answers on %s\n", daemon().c_str());
        silent_since.reset();
      } else if (!silent_since) {
        silent_since = Clock::now();
      } else if (!told && (wrong_map || Clock::now() > *silent_since + kSilence)) {
        told = true;
        const char* const what = wrong_map                 ? "nothing is sent"
                                 : sink_->progress().heard ? "relmapd does not answer any more"
                                                           : "no relmapd has answered";
        std::fprintf(stderr, "%s; keyframes wait in %s%s\n", silence(what).c_str(),
                     summary_.spool.empty() ? "memory" : summary_.spool.c_str(),
                     wrong_map ? " for their own map; another --session begins one in this map" : "");
      }
    }
    if (stop_) sink_->interrupt();
  }

  // With the reason, where it is known.
  std::string silence(const std::string& what) const {
    const Status trouble = sink_->trouble();
    return what + " on " + daemon() + (trouble.ok() ? "" : " (" + trouble.to_string() + ")");
  }

  // A sink that was interrupted takes nothing more: the run goes on there the next time.
  bool was_interrupted(const Status& status) const { return stop_ && status.reason() == Reason::SHUTTING_DOWN; }

  // `complete`: there is nothing left to read, as far as can be told.
  Status finish(bool complete) {
    if (!complete && options_.to == "file" && summary_.keyframes > 0)
      std::fprintf(stderr, "not all is written: %s.part has what came before\n", options_.out.c_str());
    auto published = settle(complete);
    if (published.ok() && published->heard && published->all_settled()) {
      // What an operator has closed is not ended by its robot, and the daemon says nothing to it.
      if (!stop_ && published->session.ok())
        sink_->end_session(options_.publisher.in_memory ? options_.patience_s : kEndPatience);
      await_news();
    }
    watcher_ = {};
    sink_->hear({});
    summary_.recognised = localisation_.counts();
    summary_.place = localisation_.place();
    if (!published.ok()) return published.status();
    summary_.publishing = std::move(*published);
    summary_.slow_downs = slow_downs_;
    const std::uint64_t restored = summary_.publishing.lost_in_restores;
    if (restored > 0)
      std::fprintf(
          stderr,
          "MAP_RESTORED: the map was restored from a backup; it lacks %llu keyframes that the spool has no more\n",
          static_cast<unsigned long long>(restored));
    if (const std::uint64_t given_up = summary_.publishing.gaps - restored; given_up > 0)
      std::fprintf(stderr, "%llu keyframes were given up: they are gaps in the map\n",
                   static_cast<unsigned long long>(given_up));
    if (!summary_.publishing.all_settled() && !stop_ && (!summary_.publishing.heard || !sink_->trouble().ok()))
      std::fprintf(stderr, "%s\n", silence("no relmapd answers").c_str());
    if (summary_.gone_on && summary_.keyframes == 0 && !stop_ && !options_.quiet)
      std::fprintf(stderr, "there is nothing after keyframe %u, with which the session goes on\n", *summary_.gone_on);
    const Status& session = summary_.publishing.session;
    return session.reason() == Reason::SESSION_DELETED ? session : Status();
  }

  // Settling may take longer than tracking did.
  Result<publishing::PublishSummary> settle(bool complete) {
    std::jthread teller([this](const std::stop_token& done) {
      for (; progress_ && !done.stop_requested(); std::this_thread::sleep_for(kLook)) show_progress();
    });
    auto published = sink_->finish(stop_ ? 0 : options_.patience_s, complete);
    teller = {};
    if (progress_) progress_->end();
    return published;
  }

  void begin_progress(std::uint64_t total, const char* what = "pairs") {
    const ProgressStyle style = options_.progress_json ? ProgressStyle::kJson
                                : options_.quiet       ? ProgressStyle::kNone
                                                       : ProgressStyle::kText;
    progress_.emplace(total, style, what);
  }
  void show_progress() { progress_->show(summary_, sink_->progress(), sink_->trouble()); }

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
    auto file = capture::KeyframeFileReader::open(keyframe_file(options_));
    if (!file.ok()) return file.status();
    // What is wrong with the file is next()'s to name.
    if (auto identity = capture::identity_of_keyframes(keyframe_file(options_)); identity.ok())
      summary_.recording = std::move(identity->recording);
    return replay(
        keyframe_file(options_), [&] { return file->next(); }, name_of_path());
  }

  Status replay_log() {
    auto log = recording::KeyframeLog::open(options_.path, options_.recorded);
    if (!log.ok()) return log.status();
    const SessionHeader& recorded = log->session().header;
    Status status = replay(
        options_.path, [&] { return log->next(); }, recorded.name, "." + recorded.uuid.to_string());
    summary_.unreadable = log->left_out();
    return status;
  }

  // Keyframes that are ready made.
  Status replay(const std::string& path, const NextKeyframe& next, const std::string& name,
                const std::string& spool_suffix = {}) {
    if (!options_.report.empty() || !options_.show.empty() || options_.all_keyframes)
      return {Reason::UNSUPPORTED, path + " holds keyframes: there are no pairs to report, to show or to choose from"};
    auto keyframe = next();
    if (!keyframe.ok()) return keyframe.status();
    if (!keyframe->has_value()) return {Reason::BAD_SIZE, path + " holds no keyframe"};
    summary_.ready_made = true;
    SessionHeader header = (*keyframe)->session;
    header.name = name;
    if (Status status = open_sink(header, capture::fingerprint_of_keyframes(header), spool_suffix); !status.ok())
      return status;
    const auto last = sink_->last_keyframe();
    begin_progress(0);
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
      show_progress();
    }
    if (Status status = finish(keyframe.ok() && !stop_); !status.ok()) return status;
    return keyframe.status();
  }

  Result<std::optional<tracking::CapturedPair>> next_pair(capture::StereoSource& source) {
    auto pair = read_ahead_ ? std::exchange(read_ahead_, {}) : read_pair(source);
    if (pair.ok() && pair->has_value()) pace_.wait(stop_);
    return pair;
  }

  Result<std::optional<tracking::CapturedPair>> read_pair(capture::StereoSource& source) {
    for (;;) {
      if (stop_) return std::optional<tracking::CapturedPair>();
      auto frame = source.next();
      if (!frame.ok()) return frame.status();
      if (!frame->has_value()) return std::optional<tracking::CapturedPair>();
      if (read_++ % options_.every != 0) continue;
      if (rig_watch_) rig_watch_->offer(**frame);
      capture::StereoFrame& read = **frame;
      return std::optional(tracking::CapturedPair{std::move(read.left), std::move(read.right), read.time_us,
                                                  read.eye_missing, read.index, std::move(read.picture), read.arrived});
    }
  }

  // Passes over the pairs that an interrupted run had, up to the one of its last keyframe: how stamps go on from there.
  tracking::StampFilter go_on_at(capture::StereoSource& source, std::int64_t time_us) {
    if (source.stamps_rise()) {
      source.skip_before(time_us);
      return tracking::StampFilter(time_us - 1);
    }
    // By how much the stamps after a clock was set are moved follows from all those before, as it did the first time.
    for (tracking::StampFilter stamps;;) {
      const tracking::StampFilter before = stamps;
      auto pair = read_pair(source);
      if (!pair.ok()) continue;
      if (!pair->has_value()) return before;
      if (const auto moved_us = stamps.admit((*pair)->time_us); !moved_us.ok() || *moved_us < time_us) continue;
      read_ahead_ = std::move(*pair);
      return before;
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

  void count(const tracking::TrackedPair& pair) {
    const tracking::PairReport& report = pair.report;
    ++summary_.pairs;
    if (report.repeated)
      ++summary_.repeated;
    else if (report.tracked)
      ++summary_.tracked;
    else
      ++summary_.lost;
    summary_.one_eyed += report.one_eye && !report.repeated;
    summary_.seen += pair.both_came;
    summary_.measured += pair.both_came && report.tracked && !report.repeated;
    one_came_ += !pair.both_came;
    summary_.tracking_ms += pair.tracking_ms;
    summary_.offset_px = report.offset_px;
  }

  Result<std::unique_ptr<capture::StereoSource>> open_pairs() {
    if (!is_camera())
      return capture::open_source(options_.source, options_.path, {.calibration = options_.calibration});
    auto buses = iidc::open_camera_buses(options_.bus);
    if (!buses.ok()) return buses.status();
    const iidc::IidcOptions iidc{options_.path, options_.camera_folder, options_.calibration, options_.rate_hz};
    auto opened = iidc::IidcSource::open(*buses, iidc, stop_);
    for (Reason told = Reason::OK; options_.wait && !stop_ && may_come(opened.reason());
         opened = iidc::IidcSource::open(*buses, iidc, stop_)) {
      if (std::exchange(told, opened.reason()) != opened.reason())
        std::fprintf(stderr, "%s; it is waited for\n", opened.status().to_string().c_str());
      for (auto looks = kCameraWait / kLook; looks > 0 && !stop_; --looks) std::this_thread::sleep_for(kLook);
    }
    if (!opened.ok()) return opened.status();
    camera_ = opened->get();
    return std::unique_ptr<capture::StereoSource>(std::move(*opened));
  }

  // At once, whatever is quiet.
  void tell_findings() const {
    for (const Status& finding : summary_.findings())
      std::fprintf(stderr, "the eyes are not as the calibration says: %s\n",
                   vision::with_advice(finding).to_string().c_str());
    const auto& findings = summary_.rig->findings;
    if (!options_.quiet && !findings.empty() && findings[0].reason() == Reason::TOO_FEW_FEATURES)
      std::fprintf(stderr, "the eyes could not be checked: %s\n", findings[0].to_string().c_str());
  }

  // Of a recording: before anything is begun, by a reader of its own.
  Status check_recording() {
    auto opened = open_pairs();
    if (!opened.ok()) return opened.status();
    summary_.rig = capture::check_first_pairs(**opened, [this] { return stop_.load(); });
    if (!summary_.rig->wrong || options_.despite_check) {
      tell_findings();
      return {};
    }
    std::string all;
    const auto findings = summary_.findings();
    for (const Status& finding : findings)
      all += (all.empty() ? "" : "; " + std::string(reason_name(finding.reason())) + ": ") +
             vision::with_advice(finding).message();
    return {findings.front().reason(), all + "; --despite-check tracks it all the same"};
  }

  // `whole`: all of the source has been read.
  void expect(const capture::StereoSource& source, const tracking::PipelineSummary& done, bool whole) {
    std::uint64_t left_out = 0;
    for (const auto& [reason, count] : done.refused) left_out += count;
    summary_.missing = source.missing();
    const std::uint64_t told = (source.expected() + options_.every - 1) / options_.every;
    if (camera_)
      summary_.expected = summary_.pairs + camera_->counts().lost;
    else if (whole && told > 0)
      summary_.expected = std::max(told, done.dropped) - done.dropped;  // what is dropped to keep up is not missing
    else  // of a pair that came with one picture the other was left out
      summary_.expected = summary_.pairs + left_out - std::min(left_out, one_came_);
  }

  void take(const iidc::IidcSource& camera) {
    const iidc::LiveCounts counts = camera.counts();
    summary_.camera = {camera.address().serial, counts.frames,     counts.lost,
                       counts.reopened,         counts.begun_anew, counts.drift_ppm};
  }

  Status track() {
    auto opened = open_pairs();
    if (!opened.ok()) return opened.status();
    capture::StereoSource& source = **opened;
    if (!options_.quiet) std::fprintf(stderr, "%s\n", source.describe().c_str());
    if (Status status = tracking::check_stereo(source.camera()); !status.ok())
      return {status.reason(), status.message() + "; --source images --mono makes places of its pictures"};
    if (!camera_) {
      summary_.recording = capture::identity_of(source);
      if (Status status = check_recording(); !status.ok()) return status;
    }
    auto imu = ImuFeed::open(options_.imu, source, options_.quiet);
    if (!imu.ok()) return imu.status();
    SessionHeader header;
    header.name = camera_ ? camera_->address().serial : name_of_path();
    header.camera = source.camera();
    header.raw = source.raw_calibration();
    if (Status status = open_sink(header, source.fingerprint()); !status.ok()) return status;
    // Only a spool knows whether a run goes on.
    if (Status status = open_reports(sink_->last_keyframe().has_value()); !status.ok()) return status;

    tracking::TrackerOptions tracker_options;
    tracker_options.every_pair = options_.all_keyframes;
    tracking::StereoTracker tracker(sink_->session(), tracker_options);
    tracking::PipelineOptions pipeline_options;
    pipeline_options.drop_oldest = options_.live;
    if (options_.live) pipeline_options.waiting = 2;
    pipeline_options.picture = options_.picture;
    if (const auto last = sink_->last_keyframe()) {
      tracker.resume(*last);
      pipeline_options.stamps = go_on_at(source, last->time_us);
    }
    tracking::PipelineStages stages;
    if (*imu) tracker.use_imu((*imu)->calibration(), source.rectifier().left_rotation());
    stages.before_tracking = [&](tracking::StereoTracker& t, std::int64_t time_us) {
      if (*imu) t.feed((*imu)->until(time_us));
      if (options_.live) t.at_most(wanted_hz_);
    };
    const bool hold_back = !camera_ && !sink_->last_keyframe();
    begin_progress(source.count() / options_.every);
    stages.capture = [&] { return next_pair(source); };
    stages.refused = [this](const Status& status) { refusals_.say(status); };
    stages.publish = [&](tracking::TrackedPair& pair) -> Status {
      count(pair);
      if (report_) report_->add(pair);
      if (show_)
        if (Status status = show_->show(draw_tracks(pair), pair.index); !status.ok()) return status;
      if (pair.keyframe)
        if (Status status = hold_back ? push_once_tracked(std::move(*pair.keyframe)) : push(*pair.keyframe);
            !status.ok())
          return status;
      show_progress();
      return {};
    };
    if (camera_)
      rig_watch_.emplace(source.rectifier(), [this](const vision::RigReport& rig) {
        summary_.rig = rig;
        tell_findings();
      });
    tracking::Pipeline pipeline(tracker, source.rectifier(), std::move(stages), pipeline_options);
    const Status status = pipeline.run();
    if (rig_watch_) rig_watch_->finish();
    take(pipeline.summary());
    expect(source, pipeline.summary(), status.ok() && !stop_ && !summary_.gone_on);
    if (camera_) take(*camera_);
    const Status closed = close_reports();
    if (!status.ok() && !was_interrupted(status)) return status;
    const Status tracked = check_tracked();
    if (tracked.ok() && !stop_)  // of a single pair
      if (Status pushed = push_held_back(); !pushed.ok()) return pushed;
    if (Status finished = finish(tracked.ok() && (!stop_ || options_.live)); !finished.ok()) return finished;
    return closed.ok() ? tracked : closed;
  }

  // Pictures of one camera: each a keyframe by itself.
  Status take_pictures() {
    capture::FolderOptions folder;
    folder.calibration = options_.calibration;
    folder.camera = options_.camera;
    auto opened = capture::open_mono_images(options_.path, folder);
    if (!opened.ok()) return opened.status();
    capture::StereoSource& source = **opened;
    if (!options_.quiet) std::fprintf(stderr, "%s\n", source.describe().c_str());
    summary_.mono = true;
    summary_.recording = capture::identity_of(source);
    SessionHeader header;
    header.name = name_of_path();
    header.camera = source.camera();
    header.raw = source.raw_calibration();
    if (Status status = open_sink(header, "mono, " + source.fingerprint()); !status.ok()) return status;
    const auto last = sink_->last_keyframe();
    std::optional<PictureReport> report;
    if (!options_.report.empty()) {
      auto report_file = PictureReport::open(options_.report, last.has_value());
      if (!report_file.ok()) return report_file.status();
      report.emplace(std::move(*report_file));
    }

    tracking::MonoOptions mono;
    if (last) {
      mono.first_sequence = last->sequence + 1;
      mono.resumed_us = last->time_us;
      source.skip_before(last->time_us + 1);
    }
    begin_progress(source.count() / options_.every, "pictures");
    tracking::MonoStages stages;
    stages.capture = [&] {
      auto picture = next_pair(source);
      if (picture.ok() && picture->has_value()) ++summary_.pairs;
      return picture;
    };
    stages.refused = [&](const Status& status) {
      ++(is_stamp(status.reason()) ? summary_.stamps_refused : summary_.unreadable)[status.reason()];
      refusals_.say(status);
    };
    stages.publish = [&](tracking::MonoPicture& picture) -> Status {
      summary_.tracking_ms += picture.description_ms;
      if (report) report->add(picture);
      if (Status status = push(picture.keyframe); !status.ok()) return status;
      show_progress();
      return {};
    };
    const Status status = tracking::run_mono(source.rectifier(), sink_->session(), stages, mono);
    const Status closed = report ? report->close() : Status();
    if (!status.ok() && !was_interrupted(status)) return status;
    if (Status finished = finish(!stop_); !finished.ok()) return finished;
    if (!closed.ok()) return closed;
    if (stop_ || summary_.keyframes > 0 || last) return {};
    return {summary_.unreadable.empty() ? Reason::NO_SUCH_FILE : summary_.unreadable.begin()->first,
            "none of the " + std::to_string(source.count()) + " pictures became a keyframe"};
  }

  Status check_tracked() const {
    return stop_ || summary_.lost == 0 || summary_.tracked > 1 ? Status() : untracked("none of ");
  }

  // `which` of the pairs that were read.
  Status untracked(const std::string& which) const {
    const std::string none = which + std::to_string(summary_.pairs) + " pairs could be tracked from the one before it";
    if (summary_.rig && summary_.rig->wrong) {  // it follows from that
      const Status finding = vision::with_advice(summary_.rig->findings.front());
      return {finding.reason(), none + ": " + finding.message()};
    }
    return {Reason::TOO_FEW_FEATURES, none + "; --show DIR draws what is seen"};
  }

  void take(const tracking::PipelineSummary& summary) {
    summary_.dropped = summary.dropped;
    for (const auto& [reason, count] : summary.refused)
      (is_stamp(reason) ? summary_.stamps_refused : summary_.unreadable)[reason] += count;
    summary_.latency_p50_ms = summary.keyframes.quantile(0.5);
    summary_.latency_p99_ms = summary.keyframes.quantile(0.99);
    summary_.tracked_p50_ms = summary.tracking.quantile(0.5);
    summary_.tracked_p99_ms = summary.tracking.quantile(0.99);
  }

  const RunOptions& options_;
  const std::atomic<bool>& stop_;
  RunSummary& summary_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  Pace pace_;
  Refusals refusals_;
  std::size_t read_ = 0;
  std::optional<tracking::CapturedPair> read_ahead_;
  publishing::Localisation localisation_;
  std::unique_ptr<KeyframeSink> sink_;
  std::jthread watcher_;
  std::optional<ProgressLine> progress_;
  std::atomic<double> wanted_hz_ = 0;                               // keyframes, by the daemon; 0: as many as there are
  std::atomic<std::chrono::steady_clock::time_point> slowed_at_{};  // when that was said last
  std::atomic<std::uint64_t> slow_downs_ = 0;
  std::optional<ReportFile> report_;
  std::unique_ptr<TrackShow> show_;
  const iidc::IidcSource* camera_ = nullptr;  // while its source is there
  std::optional<RigWatch> rig_watch_;         // of a camera
  std::uint64_t one_came_ = 0;                // pairs tracked of which one picture did not come
  std::vector<Keyframe> held_back_;           // of a recording, till a second pair is tracked
  std::optional<Vector3> last_pose_;
};

}  // namespace

Status run_frontend(const RunOptions& options, const std::atomic<bool>& stop, RunSummary& summary) {
  const auto begin = std::chrono::steady_clock::now();
  Status status = Run(options, stop, summary).everything();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  summary.interrupted = stop;
  summary.failure = status;
  return status;
}

namespace {

Status list_log(const std::string& path) {
  auto log = recording::EventLog::open(path);
  if (!log.ok()) return log.status();
  const auto sessions = recording::list_sessions(*log);
  if (!sessions.ok()) return sessions.status();
  for (const recording::RecordedSession& session : *sessions)
    std::printf("%s\n", recorded_session_json(session).c_str());
  return {};
}

Status list_photographs(const RunOptions& options) {
  const auto folder = capture::open_photographs(options.path, {.calibration = options.calibration});
  if (!folder.ok()) return folder.status();
  for (const capture::PhotographFolder::Camera& camera : folder->cameras)
    std::printf("%s\n", photographs_json(camera, folder->passed_over).c_str());
  return {};
}

}  // namespace

Status list_recording(const RunOptions& options) {
  if (options.source == "iidc") return {Reason::INVALID_ARGUMENT, "a live camera is no recording"};
  if (options.mono) return list_photographs(options);
  if (is_log(options)) return list_log(options.path);
  if (holds_keyframes(options)) {
    const auto file = capture::identity_of_keyframes(keyframe_file(options));
    if (file.ok()) std::printf("%s\n", keyframe_file_json(*file).c_str());
    return file.status();
  }
  const auto source = capture::open_source(options.source, options.path, {.calibration = options.calibration});
  if (source.ok())
    std::printf("%s\n", recording_json(capture::identity_of(**source), (*source)->supposed_rate_hz()).c_str());
  return source.status();
}

}  // namespace relmap::frontend
