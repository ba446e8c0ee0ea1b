// The figures of every picture of a mono session, as a file of tab-separated lines.
#pragma once

#include <fstream>
#include <string>

#include "frontend/tracking/mono_keyframes.h"

namespace relmap::frontend {

// A line of names comes first, then one for each picture that became a keyframe, on disk at once; behind "# " at the
// end how many there were. Not thread-safe.
class PictureReport {
 public:
  // As ReportFile::open().
  static Result<PictureReport> open(const std::string& path, bool goes_on);

  void add(const tracking::MonoPicture& picture);
  Status close();  // IO_ERROR: something did not reach the disk

 private:
  PictureReport(std::string path, std::ofstream out) : path_(std::move(path)), out_(std::move(out)) {}

  std::string path_;
  std::ofstream out_;
  std::uint64_t keyframes_ = 0, features_ = 0;
};

}  // namespace relmap::frontend
