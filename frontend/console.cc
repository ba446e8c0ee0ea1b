#include "frontend/console.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <iomanip>
#include <optional>
#include <sstream>
#include <vector>

#include "frontend/figures.h"
#include "proto/base/bar_text.h"
#include "proto/base/hex.h"
#include "proto/base/json.h"
#include "proto/base/mutex.h"
#include "proto/base/number_text.h"
#include "proto/geometry/canonical_rotation.h"

namespace relmap::frontend {

namespace {

Json counts_json(const std::map<Reason, std::uint64_t>& counts) {
  Json json;
  for (const auto& [reason, count] : counts) json.add(reason_name(reason), count);
  return json;
}

Json status_json(const Status& status) {
  return Json().add("reason", reason_name(status.reason())).add("message", status.message());
}

std::string text_counts(const std::map<Reason, std::uint64_t>& counts) {
  std::string out;
  for (const auto& [reason, count] : counts)
    out += (out.empty() ? " (" : ", ") + std::string(reason_name(reason)) + ' ' + std::to_string(count);
  return out.empty() ? out : out + ")";
}

std::uint64_t total(const std::map<Reason, std::uint64_t>& counts) {
  std::uint64_t sum = 0;
  for (const auto& [reason, count] : counts) sum += count;
  return sum;
}

// What the daemon recognised.
std::string recognition_text(const RunSummary& s) {
  const publishing::Localisation::Counts& c = s.recognised;
  std::ostringstream out;
  out << std::fixed << std::setprecision(2) << c.closures << " closures (" << c.withdrawn << " taken out)";
  if (c.unmeasured_steps > 0)
    out << "; unmeasured steps " << c.unmeasured_steps << ", found again behind " << c.recovered_steps;
  if (s.place)
    out << "; the last keyframe is " << s.place->T_frame_newest.t.norm() << " m from frame "
        << s.place->frame.to_string();
  return out.str();
}

Json recognition_json(const RunSummary& s) {
  const publishing::Localisation::Counts& c = s.recognised;
  Json json;
  json.add("closures", c.closures)
      .add("closures_withdrawn", c.withdrawn)
      .add("unmeasured_steps", c.unmeasured_steps)
      .add("recovered_steps", c.recovered_steps);
  if (!s.place) return json.add_null("place");
  const SE3& T = s.place->T_frame_newest;
  const QuaternionWxyz q = canonical_quaternion(T.R);
  return json.add("place", Json()
                               .add("frame", s.place->frame.to_string())
                               .add("recognised", s.place->recognised.to_string())
                               .add("translation", {T.t.x(), T.t.y(), T.t.z()}, 3)
                               .add("rotation_wxyz", {q[0], q[1], q[2], q[3]}, 6));
}

std::optional<double> share_of_any(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? std::nullopt : std::optional(share(part, whole));
}

// The error of disparities is known only if pairs were tracked.
std::string path_text(const RunSummary& s) {
  std::string text = fixed(s.path_m, 1) + " m";
  if (!s.ready_made) text += "; disparities were " + fixed(s.offset_px, 2) + " px off";
  return text;
}

// What happens to keyframes that are not settled.
std::string waiting_text(const RunSummary& s) {
  const std::string keyframes = std::to_string(s.publishing.unsettled) + " keyframes";
  if (s.failure.reason() == Reason::SESSION_DELETED)
    return keyframes + " of a session that takes none any more; with another --session the recording becomes a new one";
  return s.spool.empty() ? keyframes + " are kept nowhere; the same command with --uuid " + s.uuid + " makes them again"
                         : keyframes + " in " + s.spool + "; the same command goes on with them";
}

double mean_ms(const RunSummary& s) { return s.pairs == 0 ? 0 : s.tracking_ms / static_cast<double>(s.pairs); }

std::optional<Json> camera_json(const RunSummary& s) {
  if (!s.camera) return std::nullopt;
  const RunSummary::Camera& c = *s.camera;
  return Json()
      .add("serial", c.serial)
      .add("frames", c.frames)
      .add("lost", c.lost)
      .add("reopened", c.reopened)
      .add("begun_anew", c.begun_anew)
      .add("drift_ppm", c.drift_ppm, 1);
}

std::vector<Json> left_out_json(const std::vector<Status>& left_out) {
  std::vector<Json> list;
  for (const Status& status : left_out) list.push_back(status_json(status));
  return list;
}

Json identity_json(const capture::RecordingIdentity& recording) {
  return Json()
      .add("fingerprint", recording.fingerprint)
      .add("count", recording.count)
      .add("contents", hex(recording.contents))
      .add("calibration", recording.calibration);
}

// Why the run is not to be trusted. Comes first in the summary.
std::string distrust_text(const RunSummary& s) {
  if (s.trusted()) return {};
  std::ostringstream out;
  out << std::fixed << std::setprecision(1) << "NOT TO BE TRUSTED\n";
  if (const auto share = s.measured_share(); share && *share < kMinMeasured)
    out << "  measured      " << 100 * *share << " % of the pairs that there should be (" << s.measured << " of "
        << s.expected - s.repeated << "); of good recordings it is " << 100 * kMinMeasured << " % and more\n";
  for (const Status& finding : s.findings())
    out << "  eyes          " << vision::with_advice(finding).to_string() << '\n';
  return out.str();
}

std::string missing_text(const capture::MissingPictures& missing) {
  std::string text = std::to_string(missing.count) + (missing.first.empty() ? "" : ", the first: ");
  for (const std::string& name : missing.first) text += (&name == &missing.first.front() ? "" : ", ") + name;
  return text;
}

std::vector<Json> findings_json(const std::vector<Status>& findings) {
  std::vector<Json> list;
  for (const Status& finding : findings)
    list.push_back(status_json(finding).add("advice", vision::rig_advice(finding.reason())));
  return list;
}

std::optional<Json> rig_json(const std::optional<vision::RigReport>& rig) {
  if (!rig) return std::nullopt;
  return Json()
      .add("pairs", rig->pairs)
      .add("matches", rig->matches)
      .add("row_error_px", rig->row_error, 3)
      .add("row_error_90_px", rig->row_error_90, 3)
      .add("row_offset_px", rig->row_offset, 3)
      .add("row_slope_x_px", rig->row_slope_x, 3)
      .add("row_slope_y_px", rig->row_slope_y, 3)
      .add("disparity_px", rig->disparity, 3)
      .add("positive_disparity", rig->positive_disparity, 3)
      .add("negative_disparity", rig->negative_disparity, 3)
      .add("yaw_by_rows_degrees", rig->yaw_by_rows, 3)
      .add("yaw_by_motion_degrees", rig->yaw_by_motion, 3)
      .add("motions", rig->motions);
}

Json trust_json(const RunSummary& s) {
  Json json;
  json.add("trusted", s.trusted())
      .add("expected", s.expected)
      .add("seen", s.seen)
      .add("measured", s.measured)
      .add("measured_share", s.measured_share(), 6)
      .add("missing", Json().add("count", s.missing.count).add("first", s.missing.first))
      .add("findings", findings_json(s.findings()));
  return json.add("rig", rig_json(s.rig));
}

}  // namespace

std::optional<double> RunSummary::measured_share() const {
  if (expected <= repeated) return {};
  return std::min(1.0, share(measured, expected - repeated));
}

std::vector<Status> RunSummary::findings() const {
  std::vector<Status> found = rig ? rig->findings : std::vector<Status>();
  std::erase_if(found, [](const Status& finding) { return finding.reason() == Reason::TOO_FEW_FEATURES; });
  return found;
}

bool RunSummary::trusted() const { return findings().empty() && measured_share().value_or(1) >= kMinMeasured; }

ProgressLine::ProgressLine(std::uint64_t total, ProgressStyle style, const char* what)
    : total_(total),
      style_(style),
      terminal_(isatty(STDERR_FILENO) != 0),
      what_(what),
      begin_(Clock::now()),
      shown_() {}

void ProgressLine::show(const RunSummary& so_far, const publishing::PublishSummary& publishing, const Status& trouble) {
  if (style_ == ProgressStyle::kText) show_text(so_far, publishing);
  if (style_ == ProgressStyle::kJson) show_json(so_far, publishing, trouble);
}

void ProgressLine::show_json(const RunSummary& so_far, const publishing::PublishSummary& publishing,
                             const Status& trouble) {
  const auto now = Clock::now();
  if (now - shown_ < std::chrono::milliseconds(250)) return;
  shown_ = now;
  Json json;
  json.add("pairs", so_far.pairs)
      .add("of", total_ > 0 ? std::optional(total_) : std::nullopt)
      .add("keyframes", so_far.keyframes)
      .add("settled", publishing.settled)
      .add("path_m", so_far.path_m, 3)
      .add("trouble", trouble.ok() ? std::nullopt : std::optional(trouble.to_string()));
  std::fputs((json.text() + '\n').c_str(), stdout);
  std::fflush(stdout);
}

void ProgressLine::show_text(const RunSummary& so_far, const publishing::PublishSummary& publishing) {
  const std::uint64_t done = so_far.pairs;
  const auto now = Clock::now();
  if (terminal_ ? now - shown_ < std::chrono::milliseconds(100) && done != total_ : done < next_line_) return;
  shown_ = now;
  const std::uint64_t step = total_ > 0 ? std::max<std::uint64_t>(1, total_ / 20) : 100;
  next_line_ = (done / step + 1) * step;

  const double elapsed = std::chrono::duration<double>(now - begin_).count();
  std::ostringstream line;
  if (terminal_) {
    constexpr std::uint64_t kWidth = 30;
    line << '\r' << progress_bar_text(done, total_, kWidth) << ' ';
  }
  line << done;
  if (total_ > 0) line << " of " << total_;
  line << ' ' << what_ << ", " << so_far.keyframes << " keyframes, " << publishing.settled << " settled";
  if (publishing.resent > 0) line << ", " << publishing.resent << " resent";
  line << std::fixed << std::setprecision(1) << ", " << (elapsed > 0 ? static_cast<double>(done) / elapsed : 0) << ' '
       << what_ << "/s";
  if (terminal_) line << "\x1b[K";
  if (!terminal_) line << '\n';
  std::fputs(line.str().c_str(), stderr);
  std::fflush(stderr);
  drawn_ = true;
}

void Refusals::say(const Status& status) {
  constexpr std::uint64_t kAlways = 3;
  const MutexLock lock(mutex_);
  const std::uint64_t count = ++counts_[status.reason()];
  if (kept_.size() < max_kept_) kept_.push_back(status);
  if (count > kAlways && !std::has_single_bit(count)) return;
  std::fprintf(stderr, "%s%s\n", status.to_string().c_str(),
               count > kAlways ? (" (" + std::to_string(count) + " times so far)").c_str() : "");
}

std::vector<Status> Refusals::all() const {
  const MutexLock lock(mutex_);
  return kept_;
}

void ProgressLine::end() {
  if (terminal_ && drawn_) std::fputs("\n", stderr);
  drawn_ = false;
}

std::string summary_text(const RunSummary& s) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(1) << distrust_text(s);
  out << "session " << s.session << " of " << s.robot << " (" << s.uuid << ")";
  if (s.gone_on) out << ", gone on with after keyframe " << *s.gone_on;
  out << (s.interrupted ? ", interrupted" : "") << '\n';
  const bool pairs = !s.ready_made && !s.mono;
  if (pairs)
    out << "  pairs         " << s.pairs << ", tracked " << s.tracked << " (with one eye " << s.one_eyed
        << "), repeated " << s.repeated << ", lost " << s.lost << '\n';
  if (pairs && s.expected > 0)
    out << "  measured      " << 100 * s.measured_share().value_or(0) << " % of " << s.expected << " expected, "
        << s.seen << " seen by both eyes\n";
  if (s.missing.count > 0) out << "  missing       " << missing_text(s.missing) << '\n';
  if (s.mono) out << "  pictures      " << s.pairs << '\n';
  out << "  left out      unreadable " << total(s.unreadable) << text_counts(s.unreadable);
  if (!s.ready_made) out << ", time stamps " << total(s.stamps_refused) << text_counts(s.stamps_refused);
  if (pairs) out << ", dropped " << s.dropped;
  out << "\n  keyframes     " << s.keyframes;
  if (s.steps > 0) out << ", steps measured by vision " << 100 * share(s.metric_steps, s.steps) << " %";
  if (!s.mono) out << "\n  path          " << path_text(s);
  out << "\n  settled       ";
  if (s.gone_on && !s.publishing.heard && s.publishing.settled == 0)
    out << "not known until relmapd says what it has of the " << s.publishing.unsettled << " in the spool, resent ";
  else
    out << s.publishing.settled << ", unsettled " << s.publishing.unsettled << ", resent ";
  out << s.publishing.resent << ", parts resent " << s.publishing.parts_resent << ", gaps " << s.publishing.gaps;
  if (s.publishing.lost_in_restores > 0)
    out << " (" << s.publishing.lost_in_restores << " of them a restored map lacks, and the spool has no more)";
  out << '\n';
  if (s.publishing.unsettled > 0) out << "  waiting       " << waiting_text(s) << '\n';
  if (s.camera) {
    out << "  camera        " << s.camera->serial << ": frames " << s.camera->frames << ", lost " << s.camera->lost
        << ", plugged in again " << s.camera->reopened << ", begun anew " << s.camera->begun_anew;
    if (s.camera->drift_ppm) out << ", its clock " << fixed(*s.camera->drift_ppm, 1) << " ppm fast";
    out << '\n';
  }
  if (s.slow_downs > 0) out << "  slowed down   " << s.slow_downs << " times, by the daemon\n";
  if (s.publishing.heard && !s.mono) out << "  recognised    " << recognition_text(s) << '\n';
  out << "  refused       " << total(s.publishing.refused) << text_counts(s.publishing.refused) << '\n';
  if (s.ready_made) {
    out << "  time          " << s.wall_s << " s\n";
  } else if (s.mono) {
    out << "  time          " << mean_ms(s) << " ms a picture, " << s.wall_s << " s in all\n";
  } else {
    out << "  time          " << mean_ms(s) << " ms a pair, " << s.wall_s << " s in all\n";
    out << "  latency       until tracked " << s.tracked_p50_ms << " ms (median), " << s.tracked_p99_ms
        << " ms (99 %); of keyframes " << s.latency_p50_ms << " ms, " << s.latency_p99_ms << " ms\n";
  }
  return out.str();
}

std::string summary_json(const RunSummary& s) {
  const publishing::PublishSummary& p = s.publishing;
  Json json;
  json.add("robot", s.robot)
      .add("session", s.session)
      .add("uuid", s.uuid)
      .add("spool", s.spool.empty() ? std::nullopt : std::optional(s.spool))
      .add("gone_on_after", s.gone_on)
      .add("mono", s.mono)
      .add("pairs", s.pairs)
      .add("tracked", s.tracked)
      .add("one_eyed", s.one_eyed)
      .add("repeated", s.repeated)
      .add("lost", s.lost)
      .add("dropped", s.dropped)
      .add("unreadable", counts_json(s.unreadable))
      .add("stamps_refused", counts_json(s.stamps_refused))
      .add("offset_px", s.offset_px, 3)
      .add("keyframes", s.keyframes)
      .add("metric_share", share_of_any(s.metric_steps, s.steps), 6)
      .add("path_m", s.path_m, 3)
      .add("pushed", p.pushed)
      .add("settled", p.settled)
      .add("unsettled", p.unsettled)
      .add("resent", p.resent)
      .add("parts_resent", p.parts_resent)
      .add("gaps", p.gaps)
      .add("lost_in_restores", p.lost_in_restores)
      .merge(recognition_json(s))
      .add("refused", counts_json(p.refused))
      .add("restarts_seen", p.restarts_seen)
      .add("slow_downs", s.slow_downs)
      .add("ms_per_pair", mean_ms(s), 3)
      .add("latency_p50_ms", s.latency_p50_ms, 3)
      .add("latency_p99_ms", s.latency_p99_ms, 3)
      .add("tracked_p50_ms", s.tracked_p50_ms, 3)
      .add("tracked_p99_ms", s.tracked_p99_ms, 3)
      .add("recording", s.recording ? std::optional(identity_json(*s.recording)) : std::nullopt)
      .add("left_out", left_out_json(s.left_out))
      .add("camera", camera_json(s))
      .merge(trust_json(s))
      .add("wall_s", s.wall_s, 3)
      .add("interrupted", s.interrupted)
      .add("error", s.failure.ok() ? std::nullopt : std::optional(status_json(s.failure)));
  return json.text();
}

std::string recorded_session_json(const recording::RecordedSession& session) {
  return Json()
      .add("uuid", session.header.uuid.to_string())
      .add("robot", session.header.robot)
      .add("name", session.header.name)
      .add("first", session.first)
      .add("last", session.last)
      .text();
}

std::string recording_json(const capture::RecordingIdentity& recording, double supposed_rate_hz) {
  Json json = identity_json(recording);
  if (supposed_rate_hz > 0) json.add("supposed_rate_hz", supposed_rate_hz);
  return json.text();
}

std::string keyframe_file_json(const capture::KeyframeFileIdentity& file) {
  return Json()
      .add("uuid", file.session.uuid.to_string())
      .add("robot", file.session.robot)
      .add("name", file.session.name)
      .merge(identity_json(file.recording))
      .text();
}

std::string photographs_json(const capture::PhotographFolder::Camera& camera, const capture::PassedOver& passed_over) {
  Json json;
  json.add("camera", camera.name).add("pictures", camera.pictures);
  if (camera.source.ok())
    json.merge(identity_json(capture::identity_of(**camera.source)));
  else
    json.add("error", status_json(camera.source.status()));
  return json.add("folders_passed_over", passed_over.folders).add("files_passed_over", passed_over.files).text();
}

}  // namespace relmap::frontend
