// Writes the figures of each picture of a mono session to a file of tab-separated lines.
#pragma once

#include <fstream>
#include <string>

#include "frontend/tracking/mono_keyframes.h"

namespace relmap::frontend {

// The first line has the names of the columns. Then there is a line for each picture that became a keyframe, written to
// disk at once, and at the end, after "# ", their number. Not thread-safe.
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
