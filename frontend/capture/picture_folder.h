// Finding pairs of pictures in folders, and their times. No pixels here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::capture {

struct PicturePair {
  std::filesystem::path left, right;  // right: empty where there is one eye
  std::int64_t time_us = 0;
};

// Pictures (by their endings) of the folder, by name. NO_SUCH_FILE: no folder, or none in it; UNSUPPORTED: only such as
// are not read (.tiff, .bmp, .heic and the like).
Result<std::vector<std::filesystem::path>> list_pictures(const std::filesystem::path& folder);

// What lies beside the pictures of a folder and is read by nobody, by name: folders, and files of other formats. What
// is hidden (.name) does not count, nor do calibrations and times.
struct PassedOver {
  std::vector<std::string> folders, files;

  bool empty() const { return folders.empty() && files.empty(); }
  // "2 folders (north, south) and 1 file that is neither PNG nor JPEG nor PGM (x.heic)"; the first few are named.
  std::string describe() const;
};
PassedOver passed_over(const std::filesystem::path& folder);

// Pairs of the same names, also where one of the two is missing (whoever reads it will say so); where no name is on
// both sides, as many on each side in order. `right` empty: the pictures of one eye. NO_SUCH_FILE: no name in common
// and not as many.
Result<std::vector<PicturePair>> pair_up(const std::filesystem::path& left, const std::filesystem::path& right);

// Sets the times: from `times_file` (seconds, one a line) if it exists, else from names if `times_from_names` and all
// are stamps, else from the rate. Names that count (000017.png) stand for lines of the file, if it has a line for each
// number since the first, unless time passes evenly with the numbers only where lines are taken in order (the file
// leaves out what the numbers leave out). BAD_SIZE: fewer lines than pairs; CORRUPT: not a number.
struct TimesTaken {
  double rate_hz = 0;               // if that was taken, else 0
  std::vector<std::string> unseen;  // times of the file that are no pair's: "times.txt, line 12"
};
Result<TimesTaken> set_times(std::vector<PicturePair>& pairs, const std::filesystem::path& times_file,
                             bool times_from_names, double rate_hz);

}  // namespace relmap::capture
