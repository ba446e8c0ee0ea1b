// Pictures whose times stand in a list (EuRoC's data.csv, TUM's rgb.txt) or in their names, and pairs by time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "frontend/capture/picture_folder.h"
#include "proto/base/status.h"

namespace relmap::capture {

struct TimedPicture {
  std::filesystem::path path;
  std::int64_t time_us = 0;
};

enum class TimeUnit { kSeconds, kNanoseconds };

// Lines of a time stamp and a file name relative to `folder`, between them white space or a comma; # begins a comment.
// Stamps of 13, 16 or 19 digits are what they are in names (capture_time.h), all others in `unit`. The message says
// which line. CORRUPT; TIME_BACKWARDS: not later than the line before; BAD_SIZE: no picture at all.
Result<std::vector<TimedPicture>> parse_picture_list(std::string_view text, TimeUnit unit,
                                                     const std::filesystem::path& folder);

// The same of a file; the message names it. NO_SUCH_FILE, and as above.
Result<std::vector<TimedPicture>> read_picture_list(const std::filesystem::path& file, TimeUnit unit,
                                                    const std::filesystem::path& folder);

// Pictures of a folder whose names are nanoseconds. list_pictures()'s reasons; CORRUPT: another name; TIME_BACKWARDS.
Result<std::vector<TimedPicture>> list_timed_pictures(const std::filesystem::path& folder);

inline constexpr std::int64_t kSameMomentUs = 1000;

// Pairs of pictures at most kSameMomentUs apart, at the left one's time; the others are passed over.
struct TimedPairs {
  std::vector<PicturePair> pairs;
  std::vector<std::filesystem::path> alone;
};
TimedPairs pair_by_time(const std::vector<TimedPicture>& left, const std::vector<TimedPicture>& right);

// Of one eye.
TimedPairs one_eyed(const std::vector<TimedPicture>& pictures);

}  // namespace relmap::capture
