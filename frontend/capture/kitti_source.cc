#include "frontend/capture/folder_source.h"

namespace relmap::capture {

Result<std::unique_ptr<StereoSource>> open_kitti_layout(const std::string& kind, const std::string& path,
                                                        const FolderOptions& options) {
  const std::filesystem::path folder = path;
  const auto eyes =
      find_eyes(folder, {{"image_0", "image_1"}, {"image_00/data", "image_01/data"}, {"image_00", "image_01"}});
  if (!eyes.ok()) return eyes.status();
  auto pairs = pair_up(eyes->first, eyes->second);
  if (!pairs.ok()) return pairs.status();
  auto times = set_times(*pairs, folder / "times.txt", false, options.rate_hz);
  if (!times.ok()) return times.status();
  return open_pictures({kind, folder, std::move(*pairs), {}, std::move(times->unseen), times->rate_hz},
                       options.calibration.empty() ? (folder / "calib.txt").string() : options.calibration);
}

Result<std::unique_ptr<StereoSource>> open_kitti(const std::string& folder, const FolderOptions& options) {
  return open_kitti_layout("KITTI data set", folder, options);
}

}  // namespace relmap::capture
