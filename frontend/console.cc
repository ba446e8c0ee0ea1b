#include "frontend/console.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <iomanip>
#include <sstream>

#include "frontend/figures.h"
#include "proto/base/mutex.h"
#include "proto/base/number_text.h"
#include "proto/geometry/canonical_rotation.h"

namespace relmap::frontend {

namespace {

std::string json_string(const std::string& text) {
  std::ostringstream out;
  out << '"';
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out << '\\' << c;
    else if (static_cast<unsigned char>(c) < 0x20)
      out << "\\u" << std::hex << std::setw(4) << std::setfill('0') << static_cast<int>(c) << std::dec;
    else
      out << c;
  }
  out << '"';
  return out.str();
}

std::string json_counts(const std::map<Reason, std::uint64_t>& counts) {
  std::string out = "{";
  for (const auto& [reason, count] : counts)
    out += (out.size() > 1 ? ", \"" : "\"") + std::string(reason_name(reason)) + "\": " + std::to_string(count);
  return out + "}";
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

// What the daemon said of places.
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

std::string recognition_json(const RunSummary& s) {
  const publishing::Localisation::Counts& c = s.recognised;
  std::ostringstream out;
  out << std::fixed << std::setprecision(3) << "\"closures\": " << c.closures
      << ", \"closures_withdrawn\": " << c.withdrawn << ", \"unmeasured_steps\": " << c.unmeasured_steps
      << ", \"recovered_steps\": " << c.recovered_steps << ", \"place\": ";
  if (!s.place) return out.str() + "null";
  const SE3& T = s.place->T_frame_newest;
  const QuaternionWxyz q = canonical_quaternion(T.R);
  out << "{\"frame\": \"" << s.place->frame.to_string() << "\", \"recognised\": \"" << s.place->recognised.to_string()
      << "\", \"translation\": [" << fixed(T.t.x(), 3) << ", " << fixed(T.t.y(), 3) << ", " << fixed(T.t.z(), 3)
      << "], \"rotation_wxyz\": [" << fixed(q[0], 6) << ", " << fixed(q[1], 6) << ", " << fixed(q[2], 6) << ", "
      << fixed(q[3], 6) << "]}";
  return out.str();
}

std::string json_share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? "null" : std::to_string(share(part, whole));
}

// What the disparities were off by is learnt from pairs.
std::string path_text(const RunSummary& s) {
  std::string text = fixed(s.path_m, 1) + " m";
  if (!s.ready_made) text += "; disparities were " + fixed(s.offset_px, 2) + " px off";
  return text;
}

// What becomes of keyframes that are not settled.
std::string waiting_text(const RunSummary& s) {
  const std::string keyframes = std::to_string(s.publishing.unsettled) + " keyframes";
  if (s.failure.reason() == Reason::SESSION_DELETED)
    return keyframes + " of a session that takes none any more; with another --session the recording becomes a new one";
  return s.spool.empty() ? keyframes + " are kept nowhere; the same command with --uuid " + s.uuid + " makes them again"
                         : keyframes + " in " + s.spool + "; the same command goes on with them";
}

double mean_ms(const RunSummary& s) { return s.pairs == 0 ? 0 : s.tracking_ms / static_cast<double>(s.pairs); }

std::string camera_json(const RunSummary& s) {
  if (!s.camera) return "null";
  const RunSummary::Camera& c = *s.camera;
  std::ostringstream out;
  out << std::fixed << std::setprecision(1) << "{\"serial\": " << json_string(c.serial) << ", \"frames\": " << c.frames
      << ", \"lost\": " << c.lost << ", \"reopened\": " << c.reopened << ", \"begun_anew\": " << c.begun_anew
      << ", \"drift_ppm\": ";
  if (c.drift_ppm)
    out << fixed(*c.drift_ppm, 1) << '}';
  else
    out << "null}";
  return out.str();
}

std::string left_out_json(const std::vector<Status>& left_out) {
  std::string out = "[";
  for (const Status& status : left_out)
    out += (out.size() > 1 ? ", " : "") + ("{\"reason\": \"" + std::string(reason_name(status.reason()))) +
           "\", \"message\": " + json_string(status.message()) + '}';
  return out + "]";
}

std::string json_strings(const std::vector<std::string>& texts) {
  std::string out = "[";
  for (const std::string& text : texts) out += (out.size() > 1 ? ", " : "") + json_string(text);
  return out + "]";
}

// Without its braces.
std::string recording_members(const capture::RecordingIdentity& recording) {
  char contents[9];
  std::snprintf(contents, sizeof contents, "%08x", recording.contents);
  return "\"fingerprint\": " + json_string(recording.fingerprint) + ", \"count\": " + std::to_string(recording.count) +
         ", \"contents\": \"" + contents + "\", \"calibration\": " + json_string(recording.calibration);
}

// What a run is not to be trusted for, first of all.
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

std::string findings_json(const std::vector<Status>& findings) {
  std::string out = "[";
  for (const Status& finding : findings)
    out += (out.size() > 1 ? ", " : "") + ("{\"reason\": \"" + std::string(reason_name(finding.reason()))) +
           "\", \"message\": " + json_string(finding.message()) +
           ", \"advice\": " + json_string(vision::rig_advice(finding.reason())) + "}";
  return out + "]";
}

std::string rig_json(const std::optional<vision::RigReport>& rig) {
  if (!rig) return "null";
  std::ostringstream out;
  const auto angle = [&](const char* key, const std::optional<double>& degrees) {
    out << ", \"" << key << "\": ";
    if (degrees)
      out << fixed(*degrees, 3);
    else
      out << "null";
  };
  out << std::fixed << std::setprecision(3) << "{\"pairs\": " << rig->pairs << ", \"matches\": " << rig->matches
      << ", \"row_error_px\": " << rig->row_error << ", \"row_error_90_px\": " << rig->row_error_90
      << ", \"row_offset_px\": " << fixed(rig->row_offset, 3) << ", \"row_slope_x_px\": " << fixed(rig->row_slope_x, 3)
      << ", \"row_slope_y_px\": " << fixed(rig->row_slope_y, 3) << ", \"disparity_px\": " << fixed(rig->disparity, 3)
      << ", \"positive_disparity\": " << rig->positive_disparity
      << ", \"negative_disparity\": " << rig->negative_disparity;
  angle("yaw_by_rows_degrees", rig->yaw_by_rows);
  angle("yaw_by_motion_degrees", rig->yaw_by_motion);
  out << ", \"motions\": " << rig->motions << '}';
  return out.str();
}

std::string trust_json(const RunSummary& s) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(6) << "\"trusted\": " << (s.trusted() ? "true" : "false")
      << ", \"expected\": " << s.expected << ", \"seen\": " << s.seen << ", \"measured\": " << s.measured
      << ", \"measured_share\": ";
  if (const auto share = s.measured_share())
    out << *share;
  else
    out << "null";
  out << ", \"missing\": {\"count\": " << s.missing.count << ", \"first\": [";
  for (const std::string& name : s.missing.first)
    out << (&name == &s.missing.first.front() ? "" : ", ") << json_string(name);
  out << "]}, \"findings\": " << findings_json(s.findings()) << ", \"rig\": " << rig_json(s.rig);
  return out.str();
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
  std::ostringstream line;
  line << std::fixed << std::setprecision(3) << "{\"pairs\": " << so_far.pairs
       << ", \"of\": " << (total_ > 0 ? std::to_string(total_) : "null") << ", \"keyframes\": " << so_far.keyframes
       << ", \"settled\": " << publishing.settled << ", \"path_m\": " << so_far.path_m
       << ", \"trouble\": " << (trouble.ok() ? "null" : json_string(trouble.to_string())) << "}\n";
  std::fputs(line.str().c_str(), stdout);
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
    const std::uint64_t filled = total_ > 0 ? std::min(kWidth, kWidth * done / total_) : 0;
    line << '\r' << '[' << std::string(filled, '#') << std::string(kWidth - filled, '.') << "] ";
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
  out << "\n  settled       " << s.publishing.settled << ", unsettled " << s.publishing.unsettled << ", resent "
      << s.publishing.resent << ", parts resent " << s.publishing.parts_resent << ", gaps " << s.publishing.gaps;
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
  std::ostringstream out;
  out << std::fixed << std::setprecision(3) << "{\"robot\": " << json_string(s.robot)
      << ", \"session\": " << json_string(s.session) << ", \"uuid\": " << json_string(s.uuid)
      << ", \"spool\": " << (s.spool.empty() ? "null" : json_string(s.spool))
      << ", \"gone_on_after\": " << (s.gone_on ? std::to_string(*s.gone_on) : "null")
      << ", \"mono\": " << (s.mono ? "true" : "false") << ", \"pairs\": " << s.pairs << ", \"tracked\": " << s.tracked
      << ", \"one_eyed\": " << s.one_eyed << ", \"repeated\": " << s.repeated << ", \"lost\": " << s.lost
      << ", \"dropped\": " << s.dropped << ", \"unreadable\": " << json_counts(s.unreadable)
      << ", \"stamps_refused\": " << json_counts(s.stamps_refused) << ", \"offset_px\": " << fixed(s.offset_px, 3)
      << ", \"keyframes\": " << s.keyframes << ", \"metric_share\": " << json_share(s.metric_steps, s.steps)
      << ", \"path_m\": " << s.path_m << ", \"pushed\": " << p.pushed << ", \"settled\": " << p.settled
      << ", \"unsettled\": " << p.unsettled << ", \"resent\": " << p.resent << ", \"parts_resent\": " << p.parts_resent
      << ", \"gaps\": " << p.gaps << ", \"lost_in_restores\": " << p.lost_in_restores << ", " << recognition_json(s)
      << ", \"refused\": " << json_counts(p.refused) << ", \"restarts_seen\": " << p.restarts_seen
      << ", \"slow_downs\": " << s.slow_downs << ", \"ms_per_pair\": " << mean_ms(s)
      << ", \"latency_p50_ms\": " << s.latency_p50_ms << ", \"latency_p99_ms\": " << s.latency_p99_ms
      << ", \"tracked_p50_ms\": " << s.tracked_p50_ms << ", \"tracked_p99_ms\": " << s.tracked_p99_ms
      << ", \"recording\": " << (s.recording ? recording_json(*s.recording) : "null")
      << ", \"left_out\": " << left_out_json(s.left_out) << ", \"camera\": " << camera_json(s) << ", " << trust_json(s)
      << ", \"wall_s\": " << s.wall_s << ", \"interrupted\": " << (s.interrupted ? "true" : "false") << ", \"error\": ";
  if (s.failure.ok())
    out << "null}";
  else
    out << "{\"reason\": \"" << reason_name(s.failure.reason())
        << "\", \"message\": " << json_string(s.failure.message()) << "}}";
  return out.str();
}

std::string recorded_session_json(const recording::RecordedSession& session) {
  return "{\"uuid\": " + json_string(session.header.uuid.to_string()) +
         ", \"robot\": " + json_string(session.header.robot) + ", \"name\": " + json_string(session.header.name) +
         ", \"first\": " + std::to_string(session.first) + ", \"last\": " + std::to_string(session.last) + "}";
}

std::string recording_json(const capture::RecordingIdentity& recording, double supposed_rate_hz) {
  std::string out = "{" + recording_members(recording);
  if (supposed_rate_hz > 0) out += ", \"supposed_rate_hz\": " + number_text(supposed_rate_hz);
  return out + "}";
}

std::string keyframe_file_json(const capture::KeyframeFileIdentity& file) {
  return "{\"uuid\": " + json_string(file.session.uuid.to_string()) +
         ", \"robot\": " + json_string(file.session.robot) + ", \"name\": " + json_string(file.session.name) + ", " +
         recording_members(file.recording) + "}";
}

std::string photographs_json(const capture::PhotographFolder::Camera& camera, const capture::PassedOver& passed_over) {
  std::string out = "{\"camera\": " + json_string(camera.name) + ", \"pictures\": " + std::to_string(camera.pictures);
  if (camera.source.ok())
    out += ", " + recording_members(capture::identity_of(**camera.source));
  else
    out += ", \"error\": {\"reason\": \"" + std::string(reason_name(camera.source.reason())) +
           "\", \"message\": " + json_string(camera.source.status().message()) + '}';
  return out + ", \"folders_passed_over\": " + json_strings(passed_over.folders) +
         ", \"files_passed_over\": " + json_strings(passed_over.files) + "}";
}

}  // namespace relmap::frontend
