#include "tools/relmap/eye_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <initializer_list>
#include <string_view>

namespace relmap::cli {

namespace {

namespace fs = std::filesystem;

struct Names {
  std::string_view word, camera;
  std::array<std::string_view, 4> folders;  // KITTI's
};
constexpr Names kLeft{"left", "cam0", {"image_0", "image_00", "image_2", "image_02"}};
constexpr Names kRight{"right", "cam1", {"image_1", "image_01", "image_3", "image_03"}};

bool is_data_set_folder(const std::string& name, const Names& eye) {
  return name == eye.camera || std::find(eye.folders.begin(), eye.folders.end(), name) != eye.folders.end();
}

bool is_folder(const std::string& name, const Names& eye) { return name == eye.word || is_data_set_folder(name, eye); }

bool is_file(const std::string& stem, const Names& eye) {
  return stem == eye.word || stem.ends_with("_" + std::string(eye.word)) || stem == eye.camera ||
         stem == std::string(eye.camera) + "_sensor";
}

Eye eye_in(const fs::path& path, bool (&says)(const std::string& name, const Names& eye)) {
  std::string name = path.string();
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return says(name, kRight) ? Eye::kRight : says(name, kLeft) ? Eye::kLeft : Eye::kNotSaid;
}

Eye first_said(std::initializer_list<Eye> eyes) {
  const auto said = std::find_if(eyes.begin(), eyes.end(), [](Eye eye) { return eye != Eye::kNotSaid; });
  return said == eyes.end() ? Eye::kNotSaid : *said;
}

fs::path whole(const std::string& path) {
  std::error_code error;
  return fs::absolute(path, error).lexically_normal();
}

}  // namespace

Eye eye_of_picture(const std::string& path) {
  const fs::path file = whole(path), folder = file.parent_path();
  return first_said({eye_in(folder.filename(), is_folder), eye_in(folder.parent_path().filename(), is_data_set_folder),
                     eye_in(file.stem(), is_file)});
}

Eye eye_of_calibration(const std::string& path) {
  std::error_code error;
  const fs::path file = fs::is_directory(path, error) ? whole(path) / "" : whole(path);
  return first_said({eye_in(file.parent_path().filename(), is_folder), eye_in(file.stem(), is_file)});
}

}  // namespace relmap::cli
