// Folders with pictures, for the tests of this folder.
#pragma once

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

namespace relmap::testing_files {

// A new empty folder, gone with its owner.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "relmap_capture_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

inline cv::Mat noise(int width, int height, int type, int seed) {
  cv::Mat picture(height, width, type);
  cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
  random.fill(picture, cv::RNG::UNIFORM, 0, type == CV_16UC1 ? 65535 : 255);
  cv::GaussianBlur(picture, picture, {}, 2);
  return picture;
}

inline void write_picture(const std::filesystem::path& path, const cv::Mat& picture) {
  std::filesystem::create_directories(path.parent_path());
  cv::imwrite(path.string(), picture);
}

}  // namespace relmap::testing_files
