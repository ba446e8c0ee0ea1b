// Finding pairs of pictures in folders, and their times. No pixels here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "proto/status.h"

namespace relmap {

struct PicturePair {
  std::filesystem::path left, right;
  std::int64_t time_us = 0;
};

// Pictures (.png, .jpg, .jpeg in any case) of the folder, by name. NO_SUCH_FILE: no folder, or none in it.
Result<std::vector<std::filesystem::path>> list_pictures(const std::filesystem::path& folder);

// Pairs of the same names where all names agree; where none does, as many on each side in order. Otherwise
// NO_SUCH_FILE with the first picture that lacks its other eye.
Result<std::vector<PicturePair>> pair_up(const std::filesystem::path& left, const std::filesystem::path& right);

// Sets the times: from `times_file` (seconds, or 10^9 and more: seconds since 1970) if it exists, else from names if
// `times_from_names` and all are numbers, else from the rate. BAD_SIZE: fewer lines than pairs; CORRUPT: not a number;
// TIME_BACKWARDS.
Status set_times(std::vector<PicturePair>& pairs, const std::filesystem::path& times_file, bool times_from_names,
                 double rate_hz);

}  // namespace relmap
