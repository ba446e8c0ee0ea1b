// The figures of every pair as a file of tab-separated lines, and what they come to in all.
#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frontend/tracking/pipeline.h"

namespace relmap::frontend {

// A line of names comes first, then one for each pair, on disk at once; at the end, behind "# ", the summary: mean,
// median, least and most of the figures over the pairs tracked, as Sibley et al. 2010 print them in their Table 2.
// Keeps some 60 bytes of memory a pair for the medians. Not thread-safe.
class ReportFile {
 public:
  // An existing file is replaced; that of an interrupted run that `goes_on` is added to, its summary stays. IO_ERROR;
  // INVALID_ARGUMENT: what is there has not the columns of a report.
  static Result<ReportFile> open(const std::string& path, bool goes_on);

  // In order. Of a pair with a keyframe: before anything is taken out of it.
  void add(const tracking::TrackedPair& pair);
  Status close();  // IO_ERROR: something did not reach the disk

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
  std::map<TrackId, int> lengths_;  // of the tracks that go on: keyframes that measured them
  std::uint64_t pairs_ = 0, tracked_ = 0, keyframes_ = 0, steps_ = 0, metric_steps_ = 0;
  std::optional<Vector3> position_;
  double distance_ = 0;
};

}  // namespace relmap::frontend
