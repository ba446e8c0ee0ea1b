#include <optional>
#include <set>

#include "frontend/capture/folder_source.h"
#include "frontend/capture/photograph_folder.h"
#include "frontend/capture/picture_camera.h"
#include "frontend/capture/picture_list.h"
#include "proto/base/number_text.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

// Nothing if the folder has no list.
Result<std::optional<TimedPairs>> pairs_of_lists(const fs::path& folder) {
  std::error_code error;
  for (const auto& [left_name, right_name] :
       {std::pair{"left.txt", "right.txt"}, {"cam0.txt", "cam1.txt"}, {"rgb.txt", ""}}) {
    if (!fs::is_regular_file(folder / left_name, error)) continue;
    const auto left = read_picture_list(folder / left_name, TimeUnit::kSeconds, folder);
    if (!left.ok()) return left.status();
    if (!fs::is_regular_file(folder / right_name, error)) return std::optional(one_eyed(*left));
    const auto right = read_picture_list(folder / right_name, TimeUnit::kSeconds, folder);
    if (!right.ok()) return right.status();
    TimedPairs timed = pair_by_time(*left, *right);
    if (timed.pairs.empty())
      return {Reason::NO_SUCH_FILE,
              (folder / left_name).string() + ": no picture has one in " + right_name + " within 1 ms"};
    return std::optional(std::move(timed));
  }
  return std::optional<TimedPairs>();
}

// The error for a folder without photographs. It speaks of pictures in the folder itself and not of two eyes.
Status no_photographs(const fs::path& folder, const Status& status) {
  std::error_code error;
  if (fs::is_regular_file(folder, error))
    return {Reason::NO_SUCH_FILE, folder.string() + " is a file: pictures are taken by the folder that they lie in"};
  return status;
}

Status find_pairs_of_folders(PictureSet& set, double rate_hz, bool photographs) {
  const auto eyes = find_eyes(set.folder, {{"left", "right"},
                                           {"image_0", "image_1"},
                                           {"cam0/data", "cam1/data"},
                                           {"cam0", "cam1"},
                                           {"mav0/cam0/data", "mav0/cam1/data"}});
  auto pairs = eyes.ok() ? pair_up(eyes->first, eyes->second) : pair_up(set.folder, {});
  // The error for a folder without readable pictures says where they are looked for.
  if (!pairs.ok()) {
    if (photographs && !eyes.ok()) return no_photographs(set.folder, pairs.status());
    const bool none = pairs.reason() == Reason::NO_SUCH_FILE || pairs.reason() == Reason::UNSUPPORTED;
    if (eyes.ok() || !none) return pairs.status();
    return Status(eyes.reason(), eyes.status().message() + "; nor has it pictures itself: " + pairs.status().message());
  }
  auto times = set_times(*pairs, set.folder / "times.txt", true, rate_hz);
  if (!times.ok()) return times.status();
  set.pairs = std::move(*pairs);
  set.unseen = std::move(times->unseen);
  set.rate_hz = times->rate_hz;
  if (photographs) set.passed_over = passed_over(eyes.ok() ? eyes->first : set.folder);
  return {};
}

Result<PictureSet> find_images(const std::string& path, double rate_hz, bool photographs) {
  PictureSet set{"pictures in", path, {}, {}};
  auto listed = pairs_of_lists(set.folder);
  if (!listed.ok()) return listed.status();
  if (*listed) {
    set.pairs = std::move((*listed)->pairs);
    set.alone = std::move((*listed)->alone);
  } else if (Status status = find_pairs_of_folders(set, rate_hz, photographs); !status.ok()) {
    return status;
  }
  return set;
}

std::vector<fs::path> left_pictures(const PictureSet& set) {
  std::vector<fs::path> pictures;
  for (const PicturePair& pair : set.pairs) pictures.push_back(pair.left);
  return pictures;
}

void leave_those_of(PictureSet& set, const PicturesOfCamera& camera) {
  const std::set<fs::path> taken(camera.pictures.begin(), camera.pictures.end());
  std::erase_if(set.pairs, [&](const PicturePair& pair) { return !taken.contains(pair.left); });
  set.focal_length = camera.camera.focal_length();
  // Times that come from the rate must not depend on the pictures of other cameras.
  if (set.rate_hz > 0)
    if (const auto times = set_times(set.pairs, {}, true, set.rate_hz); times.ok()) set.rate_hz = times->rate_hz;
}

// Keeps the pictures of one camera: the one of that name, or the only one.
Status choose_camera(PictureSet& set, const std::string& name) {
  const std::vector<PicturesOfCamera> cameras = by_camera(left_pictures(set));
  std::string all;
  const PicturesOfCamera* chosen = nullptr;
  for (const PicturesOfCamera& of : cameras) {
    if (name.empty() ? cameras.size() == 1 : of.camera.name() == name) chosen = &of;
    all += (all.empty() ? "" : ", ") + of.camera.name() + " (" + std::to_string(of.pictures.size()) + ')';
  }
  if (!chosen)
    return {Reason::INVALID_ARGUMENT,
            set.folder.string() + " has pictures of these cameras: " + all + "; --camera NAME takes those of " +
                (name.empty() ? "one, and relmap ingest --mono makes a session of each" : "one, not " + name)};
  leave_those_of(set, *chosen);
  return {};
}

}  // namespace

Result<PhotographFolder> open_photographs(const std::string& path, const FolderOptions& options) {
  const auto set = find_images(path, options.rate_hz, true);
  if (!set.ok()) return set.status();
  PhotographFolder folder{{}, set->passed_over};
  for (const PicturesOfCamera& of : by_camera(left_pictures(*set))) {
    PictureSet taken = *set;
    leave_those_of(taken, of);
    folder.cameras.push_back(
        {of.camera.name(), of.pictures.size(), open_left_pictures(std::move(taken), options.calibration)});
  }
  return folder;
}

Result<std::unique_ptr<StereoSource>> open_images(const std::string& path, const FolderOptions& options) {
  auto set = find_images(path, options.rate_hz, false);
  if (!set.ok()) return set.status();
  return open_pictures(std::move(*set), options.calibration.empty() ? path : options.calibration);
}

Result<std::unique_ptr<StereoSource>> open_mono_images(const std::string& path, const FolderOptions& options) {
  auto set = find_images(path, options.rate_hz, true);
  if (!set.ok()) return set.status();
  if (Status status = choose_camera(*set, options.camera); !status.ok()) return status;
  return open_left_pictures(std::move(*set), options.calibration);
}

}  // namespace relmap::capture
