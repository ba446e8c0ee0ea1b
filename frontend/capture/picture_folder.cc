#include "frontend/capture/picture_folder.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "frontend/capture/capture_time.h"
#include "frontend/capture/picture_file.h"
#include "frontend/capture/text_file.h"
#include "proto/base/number_text.h"
#include "proto/base/quantile.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

std::optional<std::int64_t> time_from_name(const fs::path& path) { return time_from_stamp(path.stem().string()); }

// The number in a name such as 000017.png.
std::optional<std::size_t> number_in_name(const fs::path& path) {
  const std::string stem = path.stem().string();
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  if (error != std::errc{} || end != stem.data() + stem.size()) return {};
  return number;
}

Result<std::vector<std::int64_t>> read_times(const fs::path& file) {
  const auto text = read_text_file(file);
  if (!text.ok()) return text.status();
  std::vector<std::int64_t> times;
  for (TextLines lines(*text); lines.next();) {
    const auto time = time_from_seconds(lines.line().substr(0, lines.line().find_first_of(" \t")));
    if (!time) return {Reason::CORRUPT, file.string() + ", " + lines.where() + " is no time in seconds"};
    times.push_back(*time);
  }
  return times;
}

// Whether, with lines[i] as the time of pair i, the time per number is the same across left-out numbers as elsewhere.
bool is_even_over_gaps(const std::vector<std::size_t>& numbers, const std::vector<std::size_t>& lines,
                       const std::vector<std::int64_t>& times) {
  constexpr double kEven = 0.25;
  std::vector<double> steps, gaps;  // microseconds per number
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    const std::size_t passed = numbers[i] - numbers[i - 1];
    const double step = static_cast<double>(times[lines[i]] - times[lines[i - 1]]) / static_cast<double>(passed);
    (passed > 1 ? gaps : steps).push_back(step);
  }
  if (steps.empty()) return false;
  const double usual = upper_median(std::move(steps));
  return std::all_of(gaps.begin(), gaps.end(), [&](double gap) { return std::abs(gap - usual) <= kEven * usual; });
}

// The line of each pair. If the file was written for all frames, numbers select lines: a frame of which neither eye was
// kept leaves a gap in the numbers, but not in the file. If the file was written only for frames that were kept, time
// passes with the numbers only if lines are taken in order.
std::vector<std::size_t> lines_of(const std::vector<PicturePair>& pairs, const std::vector<std::int64_t>& times) {
  std::vector<std::size_t> in_order(pairs.size()), by_number;
  std::iota(in_order.begin(), in_order.end(), std::size_t{0});
  const auto first = number_in_name(pairs.front().left);
  for (const PicturePair& pair : pairs) {
    const auto number = number_in_name(pair.left);
    if (!first || !number || *number < *first || *number - *first >= times.size()) return in_order;
    by_number.push_back(*number - *first);
  }
  const bool written_for_kept = std::is_sorted(by_number.begin(), by_number.end()) &&
                                !is_even_over_gaps(by_number, by_number, times) &&
                                is_even_over_gaps(by_number, in_order, times);
  return written_for_kept ? in_order : by_number;
}

Result<TimesTaken> set_times_from(const fs::path& file, std::vector<PicturePair>& pairs) {
  const auto times = read_times(file);
  if (!times.ok()) return times.status();
  if (times->size() < pairs.size())
    return {Reason::BAD_SIZE, file.string() + " has " + std::to_string(times->size()) + " times for " +
                                  std::to_string(pairs.size()) + " pairs"};
  const auto lines = lines_of(pairs, *times);
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].time_us = (*times)[lines[i]];
  TimesTaken taken;
  const std::set<std::size_t> seen(lines.begin(), lines.end());
  for (std::size_t line = 0; line < times->size(); ++line)
    if (!seen.contains(line))
      taken.unseen.push_back("the pair of " + file.string() + ", time " + std::to_string(line + 1));
  return taken;
}

// "a, b, c and 7 more"
std::string first_names(const std::vector<std::string>& names) {
  constexpr std::size_t kNamed = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(kNamed, names.size()); ++i) text += (i > 0 ? ", " : "") + names[i];
  return names.size() > kNamed ? text + " and " + count_text(names.size() - kNamed) + " more" : text;
}

// "; there are pictures in its folder images" if a subfolder has pictures, since the user may have meant that one.
std::string folders_with_pictures(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (!entry->is_directory(unreadable)) continue;
    for (fs::directory_iterator file(entry->path(), unreadable), last; !unreadable && file != last;
         file.increment(unreadable))
      if (is_picture_name(file->path())) {
        names.push_back(entry->path().filename().string());
        break;
      }
  }
  std::sort(names.begin(), names.end());
  if (names.empty()) return {};
  return (names.size() == 1 ? "; there are pictures in its folder " : "; there are pictures in its folders ") +
         first_names(names);
}

}  // namespace

Result<std::vector<fs::path>> list_pictures(const fs::path& folder) {
  static const std::set<std::string> kNotRead = {".tif", ".tiff", ".bmp",  ".ppm",  ".webp", ".gif",
                                                 ".dng", ".cr2",  ".heic", ".heif", ".avif"};
  std::error_code error;
  std::vector<fs::path> pictures;
  fs::path not_read;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (is_picture_name(entry->path())) pictures.push_back(entry->path());
    if (kNotRead.count(lower_ending(entry->path())) > 0) not_read = entry->path();
  }
  if (error) return {Reason::NO_SUCH_FILE, folder.string() + ": " + error.message()};
  const std::string with_pictures = pictures.empty() ? folders_with_pictures(folder) : std::string();
  if (pictures.empty() && !not_read.empty())
    return {Reason::UNSUPPORTED, not_read.string() + ": pictures must be PNG, JPEG or PGM" + with_pictures};
  if (pictures.empty())
    return {Reason::NO_SUCH_FILE, folder.string() + " holds no pictures (.png, .jpg, .pgm)" + with_pictures};
  std::sort(pictures.begin(), pictures.end());
  return pictures;
}

Result<std::vector<TimedPicture>> list_timed_pictures(const fs::path& folder) {
  const auto files = list_pictures(folder);
  if (!files.ok()) return files.status();
  std::vector<TimedPicture> pictures;
  for (const fs::path& file : *files) {
    const auto time = time_from_nanoseconds(file.stem().string());
    if (!time) return {Reason::CORRUPT, file.string() + ": its name is no time in nanoseconds"};
    pictures.push_back({file, *time});
  }
  // Names with different numbers of digits do not sort by time.
  std::sort(pictures.begin(), pictures.end(),
            [](const TimedPicture& a, const TimedPicture& b) { return a.time_us < b.time_us; });
  for (std::size_t i = 1; i < pictures.size(); ++i)
    if (pictures[i].time_us == pictures[i - 1].time_us)
      return {Reason::TIME_BACKWARDS, pictures[i].path.string() + " is not later than the one before"};
  return pictures;
}

std::string PassedOver::describe() const {
  std::string text;
  if (!folders.empty()) text = counted_text(folders.size(), "folder") + " (" + first_names(folders) + ")";
  if (files.empty()) return text;
  return text + (text.empty() ? "" : " and ") + counted_text(files.size(), "file") +
         (files.size() == 1 ? " that is neither PNG nor JPEG nor PGM (" : " that are neither PNG nor JPEG nor PGM (") +
         first_names(files) + ")";
}

PassedOver passed_over(const fs::path& folder) {
  static const std::set<std::string> kRead = {"calib.txt", "calib_cam_to_cam.txt", "times.txt", "data.csv", "imu.csv"};
  PassedOver passed;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string(), ending = lower_ending(entry->path());
    if (name.starts_with('.')) continue;
    std::error_code unknown;
    if (entry->is_directory(unknown))
      passed.folders.push_back(name);
    else if (!is_picture_name(entry->path()) && !kRead.contains(name) && ending != ".yaml" && ending != ".yml")
      passed.files.push_back(name);
  }
  std::sort(passed.folders.begin(), passed.folders.end());
  std::sort(passed.files.begin(), passed.files.end());
  return passed;
}

Result<std::vector<PicturePair>> pair_up(const fs::path& left, const fs::path& right) {
  const auto lefts = list_pictures(left);
  if (!lefts.ok()) return lefts.status();
  std::vector<PicturePair> pairs;
  if (right.empty()) {
    for (const fs::path& picture : *lefts) pairs.push_back({picture, {}, 0});
    return pairs;
  }
  const auto rights = list_pictures(right);
  if (!rights.ok()) return rights.status();
  std::set<fs::path> names;
  for (const auto* eye : {&*lefts, &*rights})
    for (const fs::path& picture : *eye) names.insert(picture.filename());
  if (names.size() < lefts->size() + rights->size()) {
    for (const fs::path& name : names) pairs.push_back({left / name, right / name, 0});
    return pairs;
  }
  if (lefts->size() != rights->size())
    return {Reason::NO_SUCH_FILE, (right / lefts->front().filename()).string() + " is missing beside " +
                                      lefts->front().string() + ", and so are all others"};
  for (std::size_t i = 0; i < lefts->size(); ++i) pairs.push_back({(*lefts)[i], (*rights)[i], 0});
  return pairs;
}

Result<TimesTaken> set_times(std::vector<PicturePair>& pairs, const fs::path& times_file, bool times_from_names,
                             double rate_hz) {
  std::error_code ignored;
  if (fs::exists(times_file, ignored)) return set_times_from(times_file, pairs);
  if (times_from_names && std::all_of(pairs.begin(), pairs.end(),
                                      [](const PicturePair& p) { return time_from_name(p.left).has_value(); })) {
    for (PicturePair& pair : pairs) pair.time_us = *time_from_name(pair.left);
    return TimesTaken();
  }
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].time_us = kRelativeTimeBaseUs + std::llround(static_cast<double>(i) * 1e6 / rate_hz);
  return TimesTaken{rate_hz, {}};
}

}  // namespace relmap::capture
