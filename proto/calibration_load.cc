// Which of the formats a file or folder is.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include "proto/calibration.h"
#include "proto/calibration_text.h"

namespace relmap {

namespace {

namespace fs = std::filesystem;

Result<std::string> read_text(const std::string& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return {Reason::NO_SUCH_FILE, path + " cannot be read"};
  if (size > kMaxCalibrationBytes) return {Reason::CORRUPT, path + " is too long for a calibration"};
  return std::string(std::istreambuf_iterator<char>(in), {});
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

// EuRoC's other camera: the same path with the other number, where it has one.
std::string with_camera(std::string path, char number) {
  const std::size_t at = path.rfind("cam");
  if (at != std::string::npos && at + 3 < path.size() && (path[at + 3] == '0' || path[at + 3] == '1'))
    path[at + 3] = number;
  return path;
}

Result<StereoCalibration> load_euroc(const std::string& path) {
  const std::string left_path = with_camera(path, '0'), right_path = with_camera(path, '1');
  const auto left = read_text(left_path);
  if (!left.ok()) return left.status();
  if (right_path == left_path || !is_file(right_path)) return parse_euroc_calibration(*left);
  const auto right = read_text(right_path);
  if (!right.ok()) return right.status();
  return parse_euroc_calibration(*left, *right);
}

Result<StereoCalibration> load_file(const std::string& path) {
  const auto text = read_text(path);
  if (!text.ok()) return text.status();
  if (text->find("T_BS") != std::string::npos) return load_euroc(path);
  if (text->find("P0:") != std::string::npos || text->find("P_rect_00:") != std::string::npos)
    return parse_kitti_calibration(*text);
  return parse_opencv_calibration(*text);
}

}  // namespace

Result<StereoCalibration> load_calibration(const std::string& path) {
  std::string file = path;
  std::error_code error;
  if (fs::is_directory(path, error)) {
    file.clear();
    std::string looked_for;
    for (const char* name : {"calib.txt", "calib_cam_to_cam.txt", "cam0/sensor.yaml", "mav0/cam0/sensor.yaml",
                             "cam0_sensor.yaml", "stereo.yaml", "stereo.yml", "calibration.yaml", "calibration.yml"}) {
      if (file.empty() && is_file(fs::path(path) / name)) file = (fs::path(path) / name).string();
      looked_for += (looked_for.empty() ? "" : ", ") + std::string(name);
    }
    if (file.empty()) return {Reason::NO_SUCH_FILE, "no calibration in the folder " + path + ": none of " + looked_for};
  }
  auto calibration = load_file(file);
  if (calibration.ok() || calibration.reason() == Reason::NO_SUCH_FILE) return calibration;
  return {calibration.reason(), file + ": " + calibration.status().message()};
}

}  // namespace relmap
