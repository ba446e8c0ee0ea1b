// Where the parts of an export go: one file for each, or standard output for one of them.
#pragma once

#include <fstream>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"

namespace relmap::cli {

// Of the file for the part in the frame of `root`: "2-0".
std::string part_suffix(FrameId root);

// Files are written beside their names, and what was there stays until finish(). A device or a pipe is written as it
// comes.
class OutputFiles {
 public:
  // `path` empty or "-": standard output.
  OutputFiles(std::string path, std::ostream& standard_output);
  ~OutputFiles();  // without finish() nothing has changed
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  // It takes one part only: standard output, a device, a pipe.
  bool takes_one() const { return in_place_; }
  bool is_standard_output() const { return path_.empty(); }
  // The path itself for no suffix; else with the suffix before its ending: "map.tum", and "map.2-0.tum" for "2-0".
  // Standard output: "-".
  std::string name(const std::string& suffix) const;
  // The stream of the part with this suffix, until the next begins. IO_ERROR.
  Result<std::ostream*> begin(const std::string& suffix);
  // All files get their names. IO_ERROR.
  Status finish();
  // Files that are called as parts of this export and were not written by it: an earlier one had more parts. Sorted;
  // after finish().
  std::vector<std::string> left_behind() const;

 private:
  Status end();

  const std::string path_;
  std::ostream& standard_output_;
  bool in_place_ = true;
  std::ofstream file_;
  std::vector<std::string> names_;  // of files that lie beside them
  std::vector<std::string> written_;
};

// What belongs into a file and cannot be written there yet: bytes on disk, which go with it. No file is held open, so
// that there may be any number of them.
class Spool {
 public:
  // `beside`: a file in whose folder it is to be; empty: in the folder for temporary files.
  explicit Spool(const std::string& beside);
  ~Spool();
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&&) = delete;

  Status append(std::string_view bytes);    // IO_ERROR
  Status copy_to(std::ostream& out) const;  // IO_ERROR

 private:
  std::string path_;  // empty: moved from
};

}  // namespace relmap::cli
