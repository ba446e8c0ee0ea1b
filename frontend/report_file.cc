#include "frontend/report_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <ios>
#include <numeric>
#include <utility>

#include "frontend/figures.h"

namespace relmap::frontend {

namespace {

constexpr const char* kNames =
    "pair\tpicture\ttime_us\ttracked\tone_eye\trepeated\tkeyframe\tstarted_"
    "anew\tlandmarks\texpected\tfound\tinliers\trms_px\tspeed\t"
    "turn_deg\tcorrelation\toffset_px\tleft_ms\tright_ms\tfeatures_ms\trotation_ms\tmatch_ms\tmotion_ms\ttracking_ms\t"
    "description_ms";

// Opens a file for writing, whose first line is `names`. Replaces an existing file; if an interrupted run `goes_on`,
// appends to it. IO_ERROR; INVALID_ARGUMENT if the existing file has other columns, so that it is no report of this
// kind.
Result<std::ofstream> open_table(const std::string& path, const std::string& names, bool goes_on) {
  std::error_code error;
  std::string found;
  const bool is_file = std::filesystem::is_regular_file(path, error);  // a device may give lines without end
  if (is_file) std::getline(std::ifstream(path), found);
  if (found != names && is_file && std::filesystem::file_size(path, error) > 0)
    return {Reason::INVALID_ARGUMENT, path + " has not the columns of a report: it is neither replaced nor gone on in"};
  std::ofstream out(path, goes_on ? std::ios::app : std::ios::trunc);
  if (!out) return {Reason::IO_ERROR, path + " cannot be written: " + std::strerror(errno)};
  if (!goes_on || found.empty()) out << names << '\n';
  out << std::fixed << std::flush;
  return out;
}

double turn_deg(const tracking::PairReport& report) { return kDegrees * rotation_angle(report.R_previous_this); }

}  // namespace

Result<ReportFile> ReportFile::open(const std::string& path, bool goes_on) {
  auto out = open_table(path, kNames, goes_on);
  if (!out.ok()) return out.status();
  return ReportFile(path, std::move(*out));
}

ReportFile::ReportFile(std::string path, std::ofstream out)
    : path_(std::move(path)),
      out_(std::move(out)),
      series_{{{"features found", {}},
               {"inliers", {}},
               {"track length, keyframes", {}},
               {"reprojection, px", {}},
               {"speed, m/s", {}},
               {"turn, deg", {}},
               {"left eye, ms", {}},
               {"right eye, ms", {}},
               {"features, ms", {}},
               {"rotation, ms", {}},
               {"match, ms", {}},
               {"motion, ms", {}},
               {"tracking, ms", {}},
               {"description, ms", {}}}} {}

void ReportFile::add(const tracking::TrackedPair& pair) {
  const tracking::PairReport& r = pair.report;
  out_ << pair.index << '\t' << pair.picture << '\t' << pair.time_us << '\t' << r.tracked << '\t' << r.one_eye << '\t'
       << r.repeated << '\t' << r.keyframe << '\t' << r.started_anew << '\t' << r.landmarks << '\t' << r.expected
       << '\t' << r.found << '\t' << r.inliers << std::setprecision(3);
  for (const double value :
       {r.rms_px, r.speed, turn_deg(r), r.rotation_correlation, r.offset_px, pair.left_ms, pair.right_ms, r.features_ms,
        r.rotation_ms, r.match_ms, r.motion_ms, pair.tracking_ms, pair.description_ms})
    out_ << '\t' << value + 0.0;  // -0 + 0 is 0
  out_ << std::endl;              // flushed, so that readers find whole lines also after a crash

  ++pairs_;
  if (pair.keyframe) count_tracks(*pair.keyframe);
  if (r.repeated) return;
  add(kLeft, pair.left_ms);
  add(kRight, pair.right_ms);
  add(kFeatures, r.features_ms);
  add(kRotation, r.rotation_ms);
  add(kMatch, r.match_ms);
  add(kMotion, r.motion_ms);
  add(kTracking, pair.tracking_ms);
  if (pair.keyframe) add(kDescription, pair.description_ms);
  if (!r.tracked) return;
  ++tracked_;
  if (r.expected == 0) return;  // where a session begins
  add(kFound, r.found);
  add(kInliers, r.inliers);
  add(kRms, r.rms_px);
  add(kSpeed, r.speed);
  add(kTurn, turn_deg(r));
}

void ReportFile::count_tracks(const Keyframe& keyframe) {
  std::map<TrackId, int> going_on;
  for (const TrackMeasurement& measurement : keyframe.tracks) {
    const auto known = lengths_.find(measurement.track);
    going_on[measurement.track] = known == lengths_.end() ? 1 : known->second + 1;
    if (known != lengths_.end()) lengths_.erase(known);
  }
  for (const auto& [track, length] : lengths_) add(kTrackLength, length);
  lengths_ = std::move(going_on);

  ++keyframes_;
  if (keyframe.source != MotionSource::kStart) {
    ++steps_;
    metric_steps_ += is_vision(keyframe.source);
  }
  if (position_) distance_ += (keyframe.T_odom_frame.t - *position_).norm();
  position_ = keyframe.T_odom_frame.t;
}

void ReportFile::write_summary() {
  for (const auto& [track, length] : lengths_) add(kTrackLength, length);
  out_ << "# pairs\t" << pairs_ << "\n# tracked\t" << tracked_ << "\n# keyframes\t" << keyframes_ << "\n# distance, m\t"
       << distance_ << "\n# steps measured by vision\t" << share(metric_steps_, steps_)
       << "\n# \tmean\tmedian\tmin\tmax\n";
  for (Series& series : series_) {
    std::vector<float>& values = series.values;
    if (values.empty()) continue;
    std::sort(values.begin(), values.end());
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    out_ << "# " << series.name << '\t' << mean << '\t' << values[values.size() / 2] << '\t' << values.front() << '\t'
         << values.back() << '\n';
  }
}

Status ReportFile::close() {
  write_summary();
  out_.close();
  if (!out_) return {Reason::IO_ERROR, path_ + " is not complete"};
  return {};
}

Result<PictureReport> PictureReport::open(const std::string& path, bool goes_on) {
  auto out = open_table(path, "picture\tfile\ttime_us\tkeyframe\tfeatures\tdescription_ms", goes_on);
  if (!out.ok()) return out.status();
  return PictureReport(path, std::move(*out));
}

void PictureReport::add(const tracking::MonoPicture& picture) {
  const Keyframe& keyframe = picture.keyframe;
  out_ << picture.index << '\t' << picture.picture << '\t' << keyframe.time_us << '\t' << keyframe.sequence << '\t'
       << keyframe.appearance.size() << '\t' << std::setprecision(3) << picture.description_ms << std::endl;
  ++keyframes_;
  features_ += keyframe.appearance.size();
}

Status PictureReport::close() {
  out_ << "# keyframes\t" << keyframes_ << '\n';
  if (keyframes_ > 0)
    out_ << "# features, mean\t" << static_cast<double>(features_) / static_cast<double>(keyframes_) << '\n';
  out_.close();
  if (!out_) return {Reason::IO_ERROR, path_ + " is not complete"};
  return {};
}

}  // namespace relmap::frontend
