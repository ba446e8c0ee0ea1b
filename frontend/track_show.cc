#include "frontend/track_show.h"

#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

namespace relmap {

namespace {

namespace fs = std::filesystem;

// OpenCV has no view of what may not be written to; it writes nothing.
cv::Mat view_of(const ColourPicture& picture) {
  return {picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bgr.data())};
}

class PictureFolder : public TrackShow {
 public:
  explicit PictureFolder(fs::path folder) : folder_(std::move(folder)) {}

  Status show(const ColourPicture& picture) override {
    char name[32];
    std::snprintf(name, sizeof name, "%06llu.png", static_cast<unsigned long long>(count_++));
    const std::string path = folder_ / name;
    // Fast rather than small.
    if (!cv::imwrite(path, view_of(picture), {cv::IMWRITE_PNG_COMPRESSION, 1}))
      return {Reason::IO_ERROR, path + " cannot be written"};
    return {};
  }
  Status close() override { return {}; }

 private:
  fs::path folder_;
  unsigned long long count_ = 0;
};

class Film : public TrackShow {
 public:
  Film(std::string path, double rate_hz) : path_(std::move(path)), rate_hz_(rate_hz) {}

  Status show(const ColourPicture& picture) override {
    if (!writer_.isOpened() &&
        !writer_.open(path_, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), rate_hz_, {picture.width, picture.height}))
      return {Reason::UNSUPPORTED, path_ + ": no codec for MPEG-4 here; a folder of pictures can be had instead"};
    writer_.write(view_of(picture));
    return {};
  }

  // The writer keeps silent about a disk that is full.
  Status close() override {
    const bool any = writer_.isOpened();
    writer_.release();
    std::error_code error;
    if (any && (fs::file_size(path_, error) == 0 || error)) return {Reason::IO_ERROR, path_ + " is not complete"};
    return {};
  }

 private:
  std::string path_;
  double rate_hz_;
  cv::VideoWriter writer_;
};

}  // namespace

Result<std::unique_ptr<TrackShow>> open_track_show(const std::string& path, double rate_hz) {
  if (fs::path(path).extension() == ".mp4") {
    const fs::path folder = fs::absolute(path).parent_path();
    if (!fs::is_directory(folder)) return {Reason::IO_ERROR, folder.string() + " is no folder"};
    return std::unique_ptr<TrackShow>(std::make_unique<Film>(path, rate_hz));
  }
  std::error_code error;
  fs::create_directories(path, error);
  if (!fs::is_directory(path)) return {Reason::IO_ERROR, path + " cannot be made: " + error.message()};
  return std::unique_ptr<TrackShow>(std::make_unique<PictureFolder>(path));
}

}  // namespace relmap
