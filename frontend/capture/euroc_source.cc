#include "frontend/capture/folder_source.h"
#include "frontend/capture/picture_list.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

Result<std::vector<TimedPicture>> pictures_of(const fs::path& camera) {
  std::error_code error;
  const fs::path data = camera / "data";
  const fs::path& folder = fs::is_directory(data, error) ? data : camera;
  if (fs::exists(camera / "data.csv", error))
    return read_picture_list(camera / "data.csv", TimeUnit::kNanoseconds, folder);
  return list_timed_pictures(folder);
}

}  // namespace

Result<std::unique_ptr<StereoSource>> open_euroc(const std::string& path, const FolderOptions& options) {
  const fs::path folder = path;
  const auto eyes = find_eyes(folder, {{"mav0/cam0", "mav0/cam1"}, {"cam0", "cam1"}});
  if (!eyes.ok()) return eyes.status();
  const auto left = pictures_of(eyes->first);
  if (!left.ok()) return left.status();
  TimedPairs timed;
  if (eyes->second.empty()) {
    timed = one_eyed(*left);
  } else {
    const auto right = pictures_of(eyes->second);
    if (!right.ok()) return right.status();
    timed = pair_by_time(*left, *right);
    if (timed.pairs.empty())
      return {Reason::NO_SUCH_FILE, path + ": no picture of one eye has one of the other within 1 ms"};
  }
  return open_pictures({"EuRoC data set", folder, std::move(timed.pairs), std::move(timed.alone), {}, 0},
                       options.calibration.empty() ? path : options.calibration);
}

}  // namespace relmap::capture
