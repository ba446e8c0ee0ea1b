#include "tools/relmap/eye_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>

namespace relmap::cli {

namespace {

struct Names {
  std::string_view word;
  std::array<std::string_view, 6> folders;
};
constexpr Names kLeft{"left", {"cam0", "cam0_sensor", "image_0", "image_00", "image_2", "image_02"}};
constexpr Names kRight{"right", {"cam1", "cam1_sensor", "image_1", "image_01", "image_3", "image_03"}};

bool says(const std::string& name, const Names& eye) {
  return name == eye.word || name.ends_with("_" + std::string(eye.word)) ||
         std::find(eye.folders.begin(), eye.folders.end(), name) != eye.folders.end();
}

Eye eye_in(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return says(name, kRight) ? Eye::kRight : says(name, kLeft) ? Eye::kLeft : Eye::kNotSaid;
}

}  // namespace

Eye eye_named(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path whole = fs::absolute(path, error).lexically_normal();
  const fs::path folder = whole.parent_path();
  for (const fs::path& name : {whole.stem(), folder.filename(), folder.parent_path().filename()})
    if (const Eye eye = eye_in(name.string()); eye != Eye::kNotSaid) return eye;
  return Eye::kNotSaid;
}

}  // namespace relmap::cli
