// Finds pairs of pictures in folders, and their times, without reading the pictures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::capture {

struct PicturePair {
  std::filesystem::path left, right;  // right is empty if there is one eye
  std::int64_t time_us = 0;
};

// Lists the pictures of a folder (by their endings), sorted by name. NO_SUCH_FILE if there is no folder, or no picture
// in it; UNSUPPORTED if it has only pictures of other formats (.tiff, .bmp, .heic and the like).
Result<std::vector<std::filesystem::path>> list_pictures(const std::filesystem::path& folder);

struct TimedPicture {
  std::filesystem::path path;
  std::int64_t time_us = 0;
};

// Lists pictures of a folder whose names are nanoseconds. The reasons of list_pictures(); CORRUPT if a name is no time;
// TIME_BACKWARDS.
Result<std::vector<TimedPicture>> list_timed_pictures(const std::filesystem::path& folder);

// Names of what a folder has besides pictures and is not read: folders, and files of other formats. Hidden ones
// (.name), calibrations and times do not count.
struct PassedOver {
  std::vector<std::string> folders, files;

  bool empty() const { return folders.empty() && files.empty(); }
  // "2 folders (north, south) and 1 file that is neither PNG nor JPEG nor PGM (x.heic)"; the first few are named.
  std::string describe() const;
};
PassedOver passed_over(const std::filesystem::path& folder);

// Pairs pictures of the same names, even if one of the two is missing (reading it will report that). If no name occurs
// on both sides, pairs as many pictures on each side in order. An empty `right` gives the pictures of one eye.
// NO_SUCH_FILE if there is no common name and the numbers differ.
Result<std::vector<PicturePair>> pair_up(const std::filesystem::path& left, const std::filesystem::path& right);

// Sets the times of pairs: from `times_file` (seconds, one a line) if it exists, otherwise from the names if
// `times_from_names` and all names are time stamps, otherwise from the rate. If names are numbers (000017.png) and the
// file has a line for each number from the first on, the number selects the line; but if time then passes unevenly, and
// evenly when lines are taken in order, the file leaves out the same frames as the numbers, and lines are taken in
// order. BAD_SIZE if there are fewer lines than pairs; CORRUPT if a line is no number.
struct TimesTaken {
  double rate_hz = 0;               // the rate, if times come from it; otherwise 0
  std::vector<std::string> unseen;  // times of the file that belong to no pair: "times.txt, line 12"
};
Result<TimesTaken> set_times(std::vector<PicturePair>& pairs, const std::filesystem::path& times_file,
                             bool times_from_names, double rate_hz);

}  // namespace relmap::capture
