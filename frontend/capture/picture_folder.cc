#include "frontend/capture/picture_folder.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include "frontend/capture/stereo_source.h"

namespace relmap {

namespace fs = std::filesystem;

namespace {

bool is_picture_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

// Microseconds of a name that is a time stamp.
std::optional<std::int64_t> time_from_name(const fs::path& path) {
  const std::string stem = path.stem().string();
  if (stem.empty() || !std::all_of(stem.begin(), stem.end(), [](unsigned char c) { return std::isdigit(c); }))
    return {};
  if (stem.size() != 19 && stem.size() != 16 && stem.size() != 13) return {};
  const auto number = static_cast<std::int64_t>(std::stoull(stem));
  return stem.size() == 19 ? number / 1000 : stem.size() == 16 ? number : number * 1000;
}

Status read_times(const fs::path& file, std::vector<PicturePair>& pairs) {
  std::ifstream in(file);
  if (!in) return {Reason::IO_ERROR, file.string() + " cannot be read"};
  std::string line;
  std::size_t i = 0;
  while (i < pairs.size() && std::getline(in, line)) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream text(line);
    double seconds = 0;
    if (!(text >> seconds) || !std::isfinite(seconds) || seconds < 0 || seconds > 4e9)
      return {Reason::CORRUPT, file.string() + ": \"" + line + "\" is no time in seconds"};
    pairs[i++].time_us = std::llround(seconds * 1e6) + (seconds < 1e9 ? kRelativeTimeBaseUs : 0);
  }
  if (i < pairs.size())
    return {Reason::BAD_SIZE,
            file.string() + " has " + std::to_string(i) + " times for " + std::to_string(pairs.size()) + " pairs"};
  return {};
}

}  // namespace

Result<std::vector<fs::path>> list_pictures(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> pictures;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (is_picture_name(entry->path())) pictures.push_back(entry->path());
  if (error) return {Reason::NO_SUCH_FILE, folder.string() + ": " + error.message()};
  if (pictures.empty()) return {Reason::NO_SUCH_FILE, folder.string() + " holds no pictures (.png, .jpg)"};
  std::sort(pictures.begin(), pictures.end());
  return pictures;
}

Result<std::vector<PicturePair>> pair_up(const fs::path& left, const fs::path& right) {
  const auto lefts = list_pictures(left);
  if (!lefts.ok()) return lefts.status();
  const auto rights = list_pictures(right);
  if (!rights.ok()) return rights.status();
  std::vector<PicturePair> pairs;
  const fs::path* lonely = nullptr;
  std::size_t same = 0;
  for (const fs::path& picture : *lefts) {
    const bool has = std::binary_search(rights->begin(), rights->end(), right / picture.filename());
    same += has;
    if (!has && !lonely) lonely = &picture;
    pairs.push_back({picture, right / picture.filename(), 0});
  }
  if (same == lefts->size()) return pairs;
  if (same > 0 || lefts->size() != rights->size())
    return {Reason::NO_SUCH_FILE, (right / lonely->filename()).string() + " is missing beside " + lonely->string()};
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i].right = (*rights)[i];
  return pairs;
}

Status set_times(std::vector<PicturePair>& pairs, const fs::path& times_file, bool times_from_names, double rate_hz) {
  std::error_code ignored;
  if (fs::exists(times_file, ignored)) {
    if (Status status = read_times(times_file, pairs); !status.ok()) return status;
  } else if (times_from_names && std::all_of(pairs.begin(), pairs.end(),
                                             [](const PicturePair& p) { return time_from_name(p.left).has_value(); })) {
    for (PicturePair& pair : pairs) pair.time_us = *time_from_name(pair.left);
  } else {
    for (std::size_t i = 0; i < pairs.size(); ++i)
      pairs[i].time_us = kRelativeTimeBaseUs + std::llround(static_cast<double>(i) * 1e6 / rate_hz);
  }
  for (std::size_t i = 1; i < pairs.size(); ++i)
    if (pairs[i].time_us <= pairs[i - 1].time_us)
      return {Reason::TIME_BACKWARDS, pairs[i].left.string() + " is not later than the picture before it"};
  return {};
}

}  // namespace relmap
