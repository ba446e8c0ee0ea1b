#include "frontend/track_show.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

namespace relmap::frontend {

namespace {

namespace fs = std::filesystem;

// OpenCV has no read-only views; nothing is written to this one.
cv::Mat view_of(const ColourPicture& picture) {
  return {picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.bgr.data())};
}

class PictureFolder : public TrackShow {
 public:
  explicit PictureFolder(fs::path folder) : folder_(std::move(folder)) {}

  Status show(const ColourPicture& picture, std::uint64_t index) override {
    char name[32];
    std::snprintf(name, sizeof name, "%06llu.png", static_cast<unsigned long long>(index));
    const std::string path = folder_ / name;
    // Encoding must be fast rather than small.
    if (!cv::imwrite(path, view_of(picture), {cv::IMWRITE_PNG_COMPRESSION, 1}))
      return {Reason::IO_ERROR, path + " cannot be written"};
    return {};
  }
  Status close() override { return {}; }

 private:
  fs::path folder_;
};

class Film : public TrackShow {
 public:
  Film(std::string path, double rate_hz) : path_(std::move(path)), rate_hz_(rate_hz) {}

  Status show(const ColourPicture& picture, std::uint64_t) override {
    if (!writer_.isOpened() && !open({picture.width, picture.height}))
      return {Reason::UNSUPPORTED, path_ + ": no codec for MPEG-4 here; a folder of pictures can be had instead"};
    writer_.write(view_of(picture));
    return {};
  }

  // The writer does not report a full disk.
  Status close() override {
    const bool any = writer_.isOpened();
    writer_.release();
    std::error_code error;
    if (any && (fs::file_size(path_, error) == 0 || error)) return {Reason::IO_ERROR, path_ + " is not complete"};
    return {};
  }

 private:
  // Only FFmpeg, and without its messages: errors are reported here.
  bool open(cv::Size size) {
    namespace log = cv::utils::logging;
    const auto level = log::setLogLevel(log::LOG_LEVEL_SILENT);
    const bool opened =
        writer_.open(path_, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), rate_hz_, size);
    log::setLogLevel(level);
    return opened;
  }

  std::string path_;
  double rate_hz_;
  cv::VideoWriter writer_;
};

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

// Leaves an existing file unchanged.
Status check_writable(const std::string& path) {
  const bool existed = fs::exists(path);
  if (!std::ofstream(path, std::ios::app))
    return {Reason::IO_ERROR, path + " cannot be written: " + std::strerror(errno)};
  if (!existed) fs::remove(path);
  return {};
}

bool is_film(const std::string& path) {
  std::array<char, 8> begin{};  // the first box's size and kind
  return std::ifstream(path, std::ios::binary).read(begin.data(), begin.size()) &&
         std::string_view(begin.data() + 4, 4) == "ftyp";
}

Result<std::unique_ptr<TrackShow>> open_film(const std::string& path, double rate_hz, bool goes_on) {
  std::error_code error;
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) > 0 && !is_film(path))
    return {Reason::INVALID_ARGUMENT, path + " is there and is no film: it is not replaced"};
  if (goes_on && fs::exists(path))
    return {Reason::INVALID_ARGUMENT,
            path + " is there already, and this run goes on where one was interrupted: choose another file"};
  if (Status status = check_writable(path); !status.ok()) return status;
  return std::unique_ptr<TrackShow>(std::make_unique<Film>(path, rate_hz));
}

Result<std::unique_ptr<TrackShow>> open_folder(const std::string& path, bool goes_on) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!fs::is_directory(path)) return {Reason::IO_ERROR, path + " cannot be made: " + error.message()};
  if (!goes_on)
    for (fs::directory_iterator entry(path, error), end; !error && entry != end; entry.increment(error))
      if (ending_of(entry->path()) == ".png")
        return {Reason::INVALID_ARGUMENT, entry->path().string() +
                                              " is of another run, and would be taken for one of " +
                                              "this: remove the folder's pictures or choose another folder"};
  if (error) return {Reason::IO_ERROR, path + ": " + error.message()};
  return std::unique_ptr<TrackShow>(std::make_unique<PictureFolder>(path));
}

}  // namespace

Result<std::unique_ptr<TrackShow>> open_track_show(const std::string& path, double rate_hz, bool goes_on) {
  const std::string ending = ending_of(path);
  if (ending == ".mp4") return open_film(path, rate_hz, goes_on);
  for (const char* other : {".avi", ".mkv", ".mov", ".webm"})
    if (ending == other) return {Reason::UNSUPPORTED, path + ": films are .mp4, or choose a folder for pictures"};
  return open_folder(path, goes_on);
}

}  // namespace relmap::frontend
