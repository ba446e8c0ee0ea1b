// Finds the calibration in a file or folder, and which format it is of.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <vector>

#include "proto/calibration/calibration.h"
#include "proto/calibration/calibration_text.h"

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

enum class Format { kNone, kKitti, kEuroc, kKalibr, kRos, kOpenCv };

// The format, recognised by names that no other format has.
Format format_of(std::string_view text) {
  const auto has = [&](std::string_view name) { return text.find(name) != text.npos; };
  if (has("T_BS") && has("camera_model")) return Format::kEuroc;
  if (has("cam0:") && has("camera_model")) return Format::kKalibr;
  if (has("P0:") || has("P_rect_00:")) return Format::kKitti;
  if (has("camera_matrix:") && has("projection_matrix:")) return Format::kRos;
  if (has("M1:") || has("K1:") || has("cameraMatrix1:") || has("camera_matrix:")) return Format::kOpenCv;
  return Format::kNone;
}

struct EyeFiles {
  std::string left, right;  // the same path if the file is of one camera
};

// For cam0/ and cam1/, or cam0_sensor.yaml and cam1_sensor.yaml: replaces the last camera number in the path.
EyeFiles euroc_files(const std::string& path) {
  EyeFiles files{path, path};
  const std::size_t at = path.rfind("cam");
  if (at != path.npos && at + 3 < path.size() && (path[at + 3] == '0' || path[at + 3] == '1'))
    files.left[at + 3] = '0', files.right[at + 3] = '1';
  return files;
}

// For left.yaml and right.yaml, or front_left.yaml and front_right.yaml.
EyeFiles ros_files(const std::string& path) {
  std::string stem = fs::path(path).stem().string();
  const auto beside = [&](const char* eye) {
    return (fs::path(path).parent_path() / (stem + eye + fs::path(path).extension().string())).string();
  };
  for (const std::string_view eye : {"left", "right"})
    if (stem.ends_with(eye)) {
      stem.resize(stem.size() - eye.size());
      return {beside("left"), beside("right")};
    }
  return {path, path};
}

using OneEye = Result<StereoCalibration> (*)(std::string_view);
using TwoEyes = Result<StereoCalibration> (*)(std::string_view, std::string_view);

Result<StereoCalibration> load_eyes(const EyeFiles& files, OneEye one, TwoEyes two) {
  const auto left = read_text(files.left);
  if (!left.ok()) return left.status();
  if (files.right == files.left || !is_file(files.right)) return one(*left);
  const auto right = read_text(files.right);
  if (!right.ok()) return right.status();
  return two(*left, *right);
}

Result<StereoCalibration> load_file(const std::string& path) {
  const auto text = read_text(path);
  if (!text.ok()) return text.status();
  switch (format_of(*text)) {
    case Format::kEuroc:
      return load_eyes(euroc_files(path), parse_euroc_calibration, parse_euroc_calibration);
    case Format::kRos:
      return load_eyes(ros_files(path), parse_ros_calibration, parse_ros_calibration);
    case Format::kKitti:
      return parse_kitti_calibration(*text);
    case Format::kKalibr:
      return parse_kalibr_calibration(*text);
    case Format::kOpenCv:
      return parse_opencv_calibration(*text);
    case Format::kNone:
      break;
  }
  return {Reason::CORRUPT,
          "no calibration: neither OpenCV's (M1 or K1), kalibr's (cam0), ROS's (camera_matrix, projection_matrix), "
          "EuRoC's (T_BS, camera_model) nor KITTI's (P0)"};
}

// The only calibration among the .yaml and .yml files of `folder`. `looked_for` is for the message.
Result<std::string> find_in(const fs::path& folder, const std::string& looked_for) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path& path = entry->path();
    if ((path.extension() != ".yaml" && path.extension() != ".yml") || !is_file(path)) continue;
    const auto text = read_text(path.string());
    if (!text.ok()) continue;
    const Format format = format_of(*text);
    if (format == Format::kNone) continue;
    const bool has_left = format == Format::kRos && is_file(ros_files(path.string()).left);
    found.push_back(has_left ? ros_files(path.string()).left : path.string());
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  if (found.size() > 1)
    return {Reason::INVALID_ARGUMENT,
            "several calibrations in the folder " + folder.string() + ": " + found[0] + ", " + found[1] + "; name one"};
  if (found.empty())
    return {Reason::NO_SUCH_FILE, "no calibration in the folder " + folder.string() + ": neither " + looked_for +
                                      ", nor another .yaml or .yml that is one"};
  return found[0];
}

Result<std::string> find_file(const fs::path& folder) {
  std::string looked_for;
  for (const char* name : {"calib.txt", "calib_cam_to_cam.txt", "cam0/sensor.yaml", "mav0/cam0/sensor.yaml",
                           "cam0_sensor.yaml", "stereo.yaml", "stereo.yml", "calibration.yaml", "calibration.yml"}) {
    if (is_file(folder / name)) return (folder / name).string();
    looked_for += (looked_for.empty() ? "" : ", ") + std::string(name);
  }
  return find_in(folder, looked_for);
}

}  // namespace

Result<StereoCalibration> load_calibration(const std::string& path) {
  std::string file = path;
  std::error_code error;
  if (fs::is_directory(path, error)) {
    auto found = find_file(path);
    if (!found.ok()) return found.status();
    file = std::move(*found);
  }
  auto calibration = load_file(file);
  if (calibration.ok() || calibration.reason() == Reason::NO_SUCH_FILE) return calibration;
  return {calibration.reason(), file + ": " + calibration.status().message()};
}

}  // namespace relmap
