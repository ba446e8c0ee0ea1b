#include "frontend/capture/folder_source.h"

namespace relmap {

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
  if (!fs::exists(folder / "image_0", error) && fs::exists(folder / "keyframes.bin", error))
    return {Reason::UNSUPPORTED, (folder / "keyframes.bin").string() + " holds keyframes, not pictures"};
  return open_kitti_layout("simulated drive", folder, options);
}

}  // namespace

Result<std::unique_ptr<StereoSource>> open_source(const std::string& kind, const std::string& folder,
                                                  const FolderOptions& options) {
  if (kind == "auto") return open_source(kind_of(folder), folder, options);
  if (kind == "kitti") return open_kitti(folder, options);
  if (kind == "euroc") return open_euroc(folder, options);
  if (kind == "images") return open_images(folder, options);
  if (kind == "sim") return open_simulated(folder, options);
  return {Reason::INVALID_ARGUMENT, "no kind of source: '" + kind + "'; known: kitti, euroc, images, sim, auto"};
}

}  // namespace relmap
