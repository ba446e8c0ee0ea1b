// Writes pictures and folders of pictures for tests.
#pragma once

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "proto/base/bytes.h"

namespace relmap::capture::testing_files {

// A new empty folder, which is removed with this object.
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

// Adds EXIF to a JPEG that has only the focal length in millimetres of 35 mm film.
inline std::string with_focal_length(const Bytes& jpeg, std::uint8_t millimetres) {
  const Bytes exif{
      0xff, 0xe1, 0,    52,                                            // APP1, its length
      'E',  'x',  'i',  'f',  0, 0,                                    //
      'I',  'I',  42,   0,    8, 0, 0, 0,                              // little endian, the first directory at 8
      1,    0,    0x69, 0x87, 4, 0, 1, 0, 0, 0, 26,          0, 0, 0,  // one entry: EXIF's own directory at 26
      0,    0,    0,    0,                                             //
      1,    0,    0x05, 0xa4, 3, 0, 1, 0, 0, 0, millimetres, 0, 0, 0,  // one entry
      0,    0,    0,    0};
  std::string result(jpeg.begin(), jpeg.begin() + 2);
  result.append(exif.begin(), exif.end());
  result.append(jpeg.begin() + 2, jpeg.end());
  return result;
}

// For pictures of 160 x 120; the baseline is 0.2 m.
inline constexpr const char* kKittiCalibration =
    "P0: 100 0 79.5 0 0 100 59.5 0 0 0 1 0\nP1: 100 0 79.5 -20 0 100 59.5 0 0 0 1 0\n";

inline void write_kitti(const std::filesystem::path& folder, int pairs, int type = CV_8UC1) {
  for (int i = 0; i < pairs; ++i) {
    const std::string name = "00000" + std::to_string(i) + ".png";
    write_picture(folder / "image_0" / name, noise(160, 120, type, 2 * i));
    write_picture(folder / "image_1" / name, noise(160, 120, type, 2 * i + 1));
  }
  write_text(folder / "calib.txt", kKittiCalibration);
}

}  // namespace relmap::capture::testing_files
