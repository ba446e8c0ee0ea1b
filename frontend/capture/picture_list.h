// Reads the times of pictures from a list (EuRoC's data.csv, TUM's rgb.txt), and pairs pictures by time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "frontend/capture/picture_folder.h"
#include "proto/base/status.h"

namespace relmap::capture {

enum class TimeUnit { kSeconds, kNanoseconds };

// Parses lines of a time stamp and a file name relative to `folder`, separated by white space or a comma; # begins a
// comment. The unit of stamps with 13, 16 or 19 digits is as in names (capture_time.h); others are in `unit`. CORRUPT;
// TIME_BACKWARDS if a line is not later than the one before; BAD_SIZE if there is no picture. The message has the line.
Result<std::vector<TimedPicture>> parse_picture_list(std::string_view text, TimeUnit unit,
                                                     const std::filesystem::path& folder);

// The same for a file, which the message names. NO_SUCH_FILE, and the reasons above.
Result<std::vector<TimedPicture>> read_picture_list(const std::filesystem::path& file, TimeUnit unit,
                                                    const std::filesystem::path& folder);

inline constexpr std::int64_t kSameMomentUs = 1000;

// Pairs pictures that are at most kSameMomentUs apart; a pair has the time of its left picture.
struct TimedPairs {
  std::vector<PicturePair> pairs;
  std::vector<std::filesystem::path> alone;  // pictures without a counterpart
};
TimedPairs pair_by_time(const std::vector<TimedPicture>& left, const std::vector<TimedPicture>& right);

// The pictures of one eye, without right ones.
TimedPairs one_eyed(const std::vector<TimedPicture>& pictures);

}  // namespace relmap::capture
