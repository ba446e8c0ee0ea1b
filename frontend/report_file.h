// Writes the figures of each pair, or of each picture of a mono session, to a file of tab-separated lines, with a
// summary.
#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frontend/tracking/mono_keyframes.h"
#include "frontend/tracking/pipeline.h"

namespace relmap::frontend {

// The first line has the names of the columns. Then there is a line for each pair, written to disk at once, and at the
// end, after "# ", the summary: mean, median, minimum and maximum of the figures over the tracked pairs, as in Table 2
// of Sibley et al. 2010. It uses about 60 bytes of memory for each pair for the medians. Not thread-safe.
class ReportFile {
 public:
  // Replaces an existing file; if an interrupted run `goes_on`, appends to it after the old summary. IO_ERROR;
  // INVALID_ARGUMENT if the existing file does not have the columns of a report.
  static Result<ReportFile> open(const std::string& path, bool goes_on);

  // Takes pairs in order. The keyframe of a pair must be complete.
  void add(const tracking::TrackedPair& pair);
  Status close();  // IO_ERROR if something did not reach the disk

 private:
  struct Series {
    const char* name;
    std::vector<float> values;
  };
  enum Figure {
    kFound,
    kInliers,
    kTrackLength,
    kRms,
    kSpeed,
    kTurn,
    kLeft,
    kRight,
    kFeatures,
    kRotation,
    kMatch,
    kMotion,
    kTracking,
    kDescription,
    kFigures
  };

  ReportFile(std::string path, std::ofstream out);
  void add(Figure figure, double value) { series_[figure].values.push_back(static_cast<float>(value)); }
  void count_tracks(const Keyframe& keyframe);
  void write_summary();

  std::string path_;
  std::ofstream out_;
  std::array<Series, kFigures> series_;
  std::map<TrackId, int> lengths_;  // number of keyframes that measured each current track
  std::uint64_t pairs_ = 0, tracked_ = 0, keyframes_ = 0, steps_ = 0, metric_steps_ = 0;
  std::optional<Vector3> position_;
  double distance_ = 0;
};

// The same for a mono session: a line for each picture that became a keyframe, and at the end their number and the mean
// of their features.
class PictureReport {
 public:
  // Like ReportFile::open().
  static Result<PictureReport> open(const std::string& path, bool goes_on);

  void add(const tracking::MonoPicture& picture);
  Status close();  // IO_ERROR if something did not reach the disk

 private:
  PictureReport(std::string path, std::ofstream out) : path_(std::move(path)), out_(std::move(out)) {}

  std::string path_;
  std::ofstream out_;
  std::uint64_t keyframes_ = 0, features_ = 0;
};

}  // namespace relmap::frontend
