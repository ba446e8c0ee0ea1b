// The output of an export: one file for each part, or standard output for one part.
#pragma once

#include <fstream>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"

namespace relmap::cli {

// The suffix of the file whose part has the root `root`: "2-0".
std::string part_suffix(FrameId root);

// Files are written under temporary names and replace what was there in finish(). A device or a pipe is written
// directly.
class OutputFiles {
 public:
  // An empty `path`, or "-", is standard output.
  OutputFiles(std::string path, std::ostream& standard_output);
  ~OutputFiles();  // without finish(), discards what was written
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  // Whether there is room for one part only: on standard output, a device or a pipe.
  bool takes_one() const { return in_place_; }
  bool is_standard_output() const { return path_.empty(); }
  // The name of the file of a part: the path itself for an empty suffix, else with the suffix before the extension, as
  // "map.2-0.tum" for "map.tum" and "2-0". "-" for standard output.
  std::string name(const std::string& suffix) const;
  // Begins the part with this suffix. Its stream is valid until the next begin() or finish(). IO_ERROR.
  Result<std::ostream*> begin(const std::string& suffix);
  // Gives all files their final names. IO_ERROR.
  Status finish();
  // After finish(): the files that are named like parts of this export but were left by an earlier one, which had more
  // parts. Sorted.
  std::vector<std::string> left_behind() const;

 private:
  Status end();

  const std::string path_;
  std::ostream& standard_output_;
  bool in_place_ = true;
  std::ofstream file_;
  std::vector<std::string> names_;  // final names of the files that still have temporary ones
  std::vector<std::string> written_;
};

// Bytes that cannot be written to their file yet, kept on disk until the object is destroyed. No file is held open, so
// there may be any number of spools.
class Spool {
 public:
  // The spool lies in the folder of the file `beside`; if that is empty, in the folder for temporary files.
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
