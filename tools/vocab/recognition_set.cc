#include "tools/vocab/recognition_set.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "tools/vocab/picture_folder.h"

namespace relmap::vocab {
namespace fs = std::filesystem;
namespace {

Status no_such(const std::string& file) { return {Reason::NO_SUCH_FILE, file + ": cannot be read"}; }
Status corrupt(const std::string& file, const std::string& line) {
  return {Reason::CORRUPT, file + ": unexpected line '" + line + "'"};
}

// Fields of each line but the first.
Result<std::vector<std::vector<std::string>>> read_csv(const std::string& file, std::size_t fields) {
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line)) return no_such(file);
  std::vector<std::vector<std::string>> rows;
  while (std::getline(in, line)) {
    std::istringstream stream(line);
    auto& row = rows.emplace_back();
    for (std::string field; std::getline(stream, field, ',');) row.push_back(field);
    if (row.size() < fields) return corrupt(file, line);
  }
  return rows;
}

std::uint64_t number_of(const std::string& text) {
  const bool digits = !text.empty() && text.size() < 20 && text.find_first_not_of("0123456789") == std::string::npos;
  return digits ? std::stoull(text) : 0;
}

// The files of a folder, by name.
Result<std::vector<std::string>> picture_files(const std::string& folder) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    found.push_back(it->path().string());
  if (error || found.empty()) return no_such(folder);
  std::sort(found.begin(), found.end());
  return found;
}

// The pictures of a folder by the number that names them: 1.jpg, or nanoseconds.
Result<std::map<std::uint64_t, std::string>> numbered_pictures(const std::string& folder) {
  const auto files = picture_files(folder);
  if (!files.ok()) return files.status();
  std::map<std::uint64_t, std::string> found;
  for (const std::string& file : *files)
    if (const auto number = number_of(fs::path(file).stem().string()); number > 0) found[number] = file;
  return found;
}

// One drive, picture after picture. `pairs`: two pictures of one place, by their numbers, in either order;
// `is_past(later, earlier)`: no longer recent.
template <typename IsPast>
Result<RecognitionSet> one_drive(const std::string& pictures, const std::string& pairs, IsPast is_past) {
  const auto files = numbered_pictures(pictures);
  if (!files.ok()) return files.status();
  const auto rows = read_csv(pairs, 2);
  if (!rows.ok()) return rows.status();

  RecognitionSet set;
  std::map<std::uint64_t, std::uint32_t> place_of;
  std::vector<std::uint64_t> numbers;
  for (const auto& [number, file] : *files) {
    const auto i = static_cast<std::uint32_t>(numbers.size());
    auto& picture = set.pictures.emplace_back();
    picture.file = file;
    picture.frame = {1, i};
    picture.open = i == 0 ? 0 : set.pictures[i - 1].open;
    numbers.push_back(number);
    while (picture.open < i && is_past(number, numbers[picture.open])) ++picture.open;
    place_of[number] = i;
  }
  for (const auto& row : *rows) {
    const auto a = place_of.find(number_of(row[0])), b = place_of.find(number_of(row[1]));
    if (a == place_of.end() || b == place_of.end()) return corrupt(pairs, row[0] + "," + row[1]);
    auto& later = set.pictures[std::max(a->second, b->second)];
    if (const std::uint32_t earlier = std::min(a->second, b->second); earlier < later.open)
      later.same.push_back(earlier);
  }
  for (auto& picture : set.pictures) std::sort(picture.same.begin(), picture.same.end());
  return set;
}

// Two laps of a corridor, one picture every few steps.
Result<RecognitionSet> load_rtabmap(const std::string& folder) {
  constexpr std::uint64_t kRecent = 10;  // pictures
  return one_drive(folder + "/images", folder + "/loops_from_gt_bmp.csv",
                   [](std::uint64_t later, std::uint64_t earlier) { return later > earlier + kRecent; });
}

// Keyframes of a flight through one room, named by nanoseconds.
Result<RecognitionSet> load_euroc(const std::string& folder) {
  constexpr std::uint64_t kRecent = 10'000'000'000;
  return one_drive(folder + "/cam0", folder + "/revisit_pairs_from_gt.csv",
                   [](std::uint64_t later, std::uint64_t earlier) { return later > earlier + kRecent; });
}

// A simulated drive (tools/sim): the truth is where its camera stood.
Result<RecognitionSet> load_drive(const std::string& folder) {
  constexpr std::uint32_t kRecent = 10;                  // pictures
  constexpr double kNear = 3, kSameHeading = 0.8660254;  // metres; cosine of 30 degrees
  const auto files = picture_files(folder + "/image_0");
  if (!files.ok()) return files.status();
  const std::string truth = folder + "/poses.txt";
  std::ifstream in(truth);
  std::vector<std::array<double, 12>> poses(files->size());  // 3x4, by rows
  for (auto& pose : poses)
    for (double& value : pose)
      if (!(in >> value)) return Status(Reason::CORRUPT, truth + ": fewer poses than pictures");

  RecognitionSet set;
  for (std::uint32_t i = 0; i < files->size(); ++i) {
    auto& picture = set.pictures.emplace_back();
    picture.file = (*files)[i];
    picture.frame = {1, i};
    picture.open = i - std::min(i, kRecent);
    for (std::uint32_t earlier = 0; earlier < picture.open; ++earlier) {
      const auto &a = poses[i], &b = poses[earlier];
      const double metres = std::hypot(a[3] - b[3], a[7] - b[7], a[11] - b[11]);
      const double heading = a[2] * b[2] + a[6] * b[6] + a[10] * b[10];
      if (metres < kNear && heading > kSameHeading) picture.same.push_back(earlier);
    }
  }
  return set;
}

// Floors of one building that look alike: walks through them are the map, other pictures ask for the floor, or for the
// area of it (bathroom, hallway).
Result<RecognitionSet> load_tower(const std::vector<std::string>& folders, bool area) {
  constexpr std::size_t kPicture = 0, kFloor = 1, kSplit = 2, kArea = 5;
  RecognitionSet set;
  std::map<std::string, SessionNumber> walks;
  std::map<std::string, std::vector<std::uint32_t>> places;
  struct Question {
    std::string file, place;
  };
  std::vector<Question> questions;
  for (const std::string& folder : folders) {
    const std::string list = folder + "/dataset.csv";
    const auto rows = read_csv(list, area ? kArea + 1 : kSplit + 1);
    if (!rows.ok()) return rows.status();
    for (const auto& row : *rows) {
      const std::string &picture_name = row[kPicture], file = folder + "/" + picture_name;
      const std::string place = area ? row[kFloor] + "/" + row[kArea] : row[kFloor];
      if (row[kSplit] != "gallery" && row[kSplit] != "query") return corrupt(list, picture_name);
      if (row[kSplit] == "query") {
        questions.push_back({file, place});
        continue;
      }
      // "..._frame_000012.jpg": the walk, and the frame within it; every second frame is here.
      const std::size_t frame = picture_name.rfind("_frame_");
      if (frame == std::string::npos) return corrupt(list, picture_name);
      const auto walk = walks.try_emplace(picture_name.substr(0, frame), static_cast<SessionNumber>(walks.size() + 1));
      places[place].push_back(static_cast<std::uint32_t>(set.pictures.size()));
      auto& picture = set.pictures.emplace_back();
      picture.file = file;
      picture.frame = {walk.first->second,
                       static_cast<std::uint32_t>(number_of(fs::path(picture_name.substr(frame + 7)).stem().string()))};
      picture.asks = false;
    }
  }
  const auto gallery = static_cast<std::uint32_t>(set.pictures.size());
  for (const Question& question : questions) {
    auto& picture = set.pictures.emplace_back();
    picture.file = question.file;
    picture.frame = {0, static_cast<std::uint32_t>(set.pictures.size())};
    picture.stays = false;
    picture.open = gallery;
    picture.same = places[question.place];
  }
  return set;
}

// The map holds the photographs of the first folder, each as a session of its own unless they are `one_walk`, and the
// pictures of the other folders. Then each photograph i of the first folder asks for those with `same(i, k)`.
template <typename Same>
Result<RecognitionSet> photographs(const std::vector<std::string>& folders, bool one_walk, Same same) {
  RecognitionSet set;
  SessionNumber session = 0;
  const auto add_session = [&](const std::vector<std::string>& files) {
    ++session;
    for (std::uint32_t i = 0; i < files.size(); ++i) {
      auto& picture = set.pictures.emplace_back();
      picture.file = files[i];
      picture.frame = {session, i};
      picture.asks = false;
    }
  };
  std::vector<std::string> asking;
  for (const std::string& folder : folders) {
    const auto files = list_pictures({folder}, 1);
    if (!files.ok()) return files.status();
    if (files->empty()) return no_such(folder);
    if (asking.empty()) asking = *files;
    if (one_walk || folder != folders.front())
      add_session(*files);
    else
      for (const std::string& file : *files) add_session({file});
  }
  const auto in_map = static_cast<std::uint32_t>(set.pictures.size());
  for (std::uint32_t i = 0; i < asking.size(); ++i) {
    auto& picture = set.pictures.emplace_back();
    picture.file = asking[i];
    picture.frame = {0, i + 1};
    picture.stays = false;
    picture.open = in_map;
    picture.itself = i;
    for (std::uint32_t k = 0; k < asking.size(); ++k)
      if (k != i && same(i, k)) picture.same.push_back(k);
  }
  return set;
}

Result<RecognitionSet> load_walk(const std::vector<std::string>& folders) {
  constexpr std::uint32_t kBeside = 2;
  return photographs(folders, true,
                     [](std::uint32_t i, std::uint32_t k) { return std::max(i, k) - std::min(i, k) <= kBeside; });
}

Result<RecognitionSet> load_front(const std::vector<std::string>& folders) {
  return photographs(folders, false, [](std::uint32_t, std::uint32_t) { return true; });
}

}  // namespace

Result<RecognitionSet> load_recognition_set(const std::string& name, const std::vector<std::string>& folders) {
  if (folders.empty()) return Status(Reason::INVALID_ARGUMENT, name + ": no folder is given");
  if (name == "tower" || name == "tower-area") return load_tower(folders, name == "tower-area");
  if (name == "walk") return load_walk(folders);
  if (name == "front") return load_front(folders);
  const std::string& folder = folders.front();
  if (folders.size() > 1)
    return Status(Reason::INVALID_ARGUMENT, folders[1] + ": not used, since " + name + " is one folder");
  if (name == "rtabmap" || name == "corridor") return load_rtabmap(folder);
  if (name == "euroc") return load_euroc(folder);
  if (name == "drive") return load_drive(folder);
  return Status(Reason::INVALID_ARGUMENT,
                name + ": there is no set of that name; there are rtabmap, corridor, euroc, drive, " +
                    "tower, tower-area, walk, front");
}

}  // namespace relmap::vocab
