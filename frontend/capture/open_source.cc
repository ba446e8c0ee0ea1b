#include "frontend/capture/folder_source.h"
#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/raw_log.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

std::string kind_of(const fs::path& folder) {
  const auto has = [&](const char* name) {
    std::error_code error;
    return fs::exists(folder / name, error);
  };
  if (has("sim.json")) return "sim";
  if (has("mav0/cam0") || has("cam0/data.csv") || has("cam0/sensor.yaml") || has("cam0_sensor.yaml")) return "euroc";
  if (has("calib.txt") && (has("image_0") || has("image_00"))) return "kitti";
  return "images";
}

Result<std::unique_ptr<StereoSource>> open_simulated(const fs::path& folder, const FolderOptions& options) {
  std::error_code error;
  const std::string keyframes = (folder / "keyframes.bin").string();
  if (!fs::exists(folder / "image_0", error) && is_keyframe_file(keyframes))
    return {Reason::UNSUPPORTED, keyframes + " holds keyframes, not pictures"};
  if (fs::is_directory(folder, error) && !fs::exists(folder / "sim.json", error))
    return {Reason::NO_SUCH_FILE, folder.string() + " is no drive of relmap-sim, for there is no sim.json in it: " +
                                      "--source auto or kitti reads pictures of others"};
  return open_kitti_layout("simulated drive", folder, options);
}

}  // namespace

Result<std::unique_ptr<StereoSource>> open_source(const std::string& kind, const std::string& folder,
                                                  const FolderOptions& options) {
  if (kind == "raw" || (kind == "auto" && is_raw_log(folder))) return open_raw_log(folder, options);
  if (std::error_code error; (kind == "auto" || kind == "sim") && fs::is_regular_file(folder, error))
    return {
        Reason::UNSUPPORTED,
        folder + (is_keyframe_file(folder) ? " holds keyframes, not pictures"
                                           : " is none of: a file of keyframes (keyframes.bin), an LCM log, a raw log, "
                                             "a folder of pictures")};
  if (kind == "auto") return open_source(kind_of(folder), folder, options);
  if (kind == "kitti") return open_kitti(folder, options);
  if (kind == "euroc") return open_euroc(folder, options);
  if (kind == "images") return open_images(folder, options);
  if (kind == "sim") return open_simulated(folder, options);
  return {Reason::INVALID_ARGUMENT, "no kind of source: '" + kind + "'; known: kitti, euroc, images, sim, raw, auto"};
}

}  // namespace relmap::capture
