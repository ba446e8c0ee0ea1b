#include "frontend/capture/picture_list.h"

#include <algorithm>
#include <optional>
#include <string>

#include "frontend/capture/capture_time.h"
#include "frontend/capture/text_file.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

std::optional<std::int64_t> time_of(std::string_view stamp, TimeUnit unit) {
  if (const auto time = time_from_stamp(stamp)) return time;
  return unit == TimeUnit::kSeconds ? time_from_seconds(stamp) : time_from_nanoseconds(stamp);
}

}  // namespace

Result<std::vector<TimedPicture>> parse_picture_list(std::string_view text, TimeUnit unit, const fs::path& folder) {
  std::vector<TimedPicture> pictures;
  for (TextLines lines(text); lines.next();) {
    const std::string_view line = lines.line();
    const std::size_t stamp_end = std::min(line.find_first_of(" \t,"), line.size());
    std::string_view name = trimmed(line.substr(stamp_end));
    if (name.starts_with(',')) name = trimmed(name.substr(1));
    const auto time = time_of(line.substr(0, stamp_end), unit);
    if (!time || name.empty()) return {Reason::CORRUPT, lines.where() + " is no time and file name"};
    if (!pictures.empty() && *time <= pictures.back().time_us)
      return {Reason::TIME_BACKWARDS, lines.where() + " is not later than the one before"};
    pictures.push_back({folder / name, *time});
  }
  if (pictures.empty()) return {Reason::BAD_SIZE, "names no picture"};
  return pictures;
}

Result<std::vector<TimedPicture>> read_picture_list(const fs::path& file, TimeUnit unit, const fs::path& folder) {
  const auto text = read_text_file(file);
  if (!text.ok()) return text.status();
  auto pictures = parse_picture_list(*text, unit, folder);
  if (!pictures.ok()) return {pictures.reason(), file.string() + ": " + pictures.status().message()};
  return pictures;
}

TimedPairs pair_by_time(const std::vector<TimedPicture>& left, const std::vector<TimedPicture>& right) {
  TimedPairs result;
  auto l = left.begin(), r = right.begin();
  while (l != left.end() || r != right.end()) {
    if (r == right.end() || (l != left.end() && l->time_us < r->time_us - kSameMomentUs)) {
      result.alone.push_back((l++)->path);
    } else if (l == left.end() || r->time_us < l->time_us - kSameMomentUs) {
      result.alone.push_back((r++)->path);
    } else {
      result.pairs.push_back({l->path, r->path, l->time_us});
      ++l, ++r;
    }
  }
  return result;
}

TimedPairs one_eyed(const std::vector<TimedPicture>& pictures) {
  TimedPairs result;
  for (const TimedPicture& picture : pictures) result.pairs.push_back({picture.path, {}, picture.time_us});
  return result;
}

}  // namespace relmap::capture
