#include "frontend/capture/folder_source.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>

#include "frontend/capture/contents_checksum.h"
#include "frontend/capture/imu_file.h"
#include "frontend/capture/picture_file.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"
#include "proto/base/number_text.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

// "10", "12.5"
std::string rate_text(double rate_hz) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", rate_hz);
  return text;
}

class FolderSource : public StereoSource {
 public:
  FolderSource(PictureSet set, const StereoCalibration& calibration, vision::Rectifier rectifier, std::string note = {})
      : set_(std::move(set)), calibration_(calibration), rectifier_(std::move(rectifier)), note_(std::move(note)) {}

  const StereoCalibration& calibration() const override { return calibration_; }
  const vision::Rectifier& rectifier() const override { return rectifier_; }
  std::string imu() const override { return find_imu(set_.folder.string()); }
  std::size_t count() const override { return set_.pairs.size(); }
  std::size_t skipped() const override { return set_.alone.size(); }
  std::size_t expected() const override {
    return calibration_.mono() ? count() : count() + set_.alone.size() + set_.unseen.size();
  }
  MissingPictures missing() const override {
    if (!missing_) missing_ = calibration_.mono() ? MissingPictures() : find_missing();
    return *missing_;
  }
  double supposed_rate_hz() const override { return set_.rate_hz; }
  std::string describe() const override {
    std::string text = set_.kind + ' ' + set_.folder.string() + ": " + std::to_string(count()) +
                       (calibration_.mono() ? " pictures of one eye, " : " pairs of ") +
                       size_text(camera().width, camera().height) + note_;
    if (!rectifier_.passes_through()) text += ", to be rectified";
    if (set_.rate_hz > 0) text += ", times by a rate of " + rate_text(set_.rate_hz) + "/s (no times.txt)";
    if (skipped() > 0)
      text += "; passed over: " + std::to_string(skipped()) + " without the other eye, the first " +
              set_.alone.front().string();
    if (const MissingPictures gone = missing(); gone.count > 0)
      text += "; " + std::to_string(expected()) + " pairs are told of, and missing are " + std::to_string(gone.count) +
              " pictures, the first " + gone.first.front();
    if (!set_.passed_over.empty()) text += "; passed over beside them: " + set_.passed_over.describe();
    return text;
  }
  std::string fingerprint() const override {
    const PicturePair& first = set_.pairs.front();
    std::ifstream in(first.left, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const std::string crc = hex(crc32c({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}));
    return "pairs from " + std::to_string(first.time_us) + " us on, the first picture of checksum " + crc;
  }
  std::uint32_t contents() const override {
    ContentsChecksum checksum;
    for (const PicturePair& pair : set_.pairs) {
      checksum.add(pair.time_us);
      checksum.add_file(pair.left);
      if (!pair.right.empty()) checksum.add_file(pair.right);
    }
    return checksum.value();
  }
  bool stamps_rise() const override { return std::ranges::is_sorted(set_.pairs, {}, &PicturePair::time_us); }
  void skip_before(std::int64_t time_us) override {
    while (next_ < count() && set_.pairs[next_].time_us < time_us) ++next_;
  }
  Result<std::optional<StereoFrame>> next() override {
    if (next_ >= count()) return std::optional<StereoFrame>();
    StereoFrame frame;
    frame.index = next_;
    const PicturePair& pair = set_.pairs[next_++];
    frame.time_us = pair.time_us;
    frame.picture = pair.left.filename().string();
    frame.eye_missing = read(pair.left, frame.left);
    if (!pair.right.empty())
      if (Status status = read(pair.right, frame.right); frame.eye_missing.ok()) frame.eye_missing = std::move(status);
    if (frame.left.empty() && frame.right.empty()) return frame.eye_missing;
    return std::optional<StereoFrame>(std::move(frame));
  }

 private:
  MissingPictures find_missing() const {
    MissingPictures missing;
    std::error_code error;
    for (const PicturePair& pair : set_.pairs)
      for (const fs::path& picture : {pair.left, pair.right})
        if (!fs::exists(picture, error)) missing.add(picture.string());
    for (const fs::path& picture : set_.alone) missing.add("the other eye of " + picture.string());
    for (const std::string& pair : set_.unseen) missing.add(pair);
    return missing;
  }

  Status read(const fs::path& path, vision::Image& into) const {
    auto picture = read_picture(path, set_.max_pixels);
    if (!picture.ok()) return picture.status();
    if (picture->width() != camera().width || picture->height() != camera().height)
      return {Reason::BAD_SIZE, path.string() + ": a picture of " + size_text(picture->width(), picture->height()) +
                                    " among those of " + size_text(camera().width, camera().height)};
    into = std::move(*picture);
    return {};
  }

  PictureSet set_;
  StereoCalibration calibration_;
  vision::Rectifier rectifier_;
  std::string note_;  // for describe()
  // Determined on demand, since it queries the disk for each picture, and callers that read only the first pairs do not
  // need it.
  mutable std::optional<MissingPictures> missing_;
  std::size_t next_ = 0;
};

// The size of the first left picture that can be read; next() reports bad ones before it.
Result<std::pair<fs::path, vision::PictureSize>> first_size(const std::vector<PicturePair>& pairs) {
  Status first;
  for (const PicturePair& pair : pairs) {
    const auto size = read_picture_size(pair.left);
    if (size.ok()) return std::pair{pair.left, *size};
    if (first.ok()) first = size.status();
  }
  return first;
}

// A lens that is neither wide nor long: 45 degrees across the longer side.
constexpr double kUsualFocalLength = 1.2;  // longer sides

StereoCalibration undistorted_camera(int width, int height, double focal_length) {
  StereoCalibration calibration;
  calibration.left.fx = calibration.left.fy = focal_length;
  calibration.left.cx = 0.5 * (width - 1);
  calibration.left.cy = 0.5 * (height - 1);
  calibration.width = width;
  calibration.height = height;
  calibration.rectified = true;
  return calibration;
}

struct FirstPicture {
  fs::path path;
  vision::PictureSize whole;  // size in the file
  int width = 0, height = 0;  // size after reduction
};

// The first picture that can be decoded; the others must have its size.
Result<FirstPicture> first_picture(const PictureSet& set) {
  Status first;
  for (const PicturePair& pair : set.pairs) {
    const auto picture = read_picture(pair.left, set.max_pixels);
    const auto whole = read_picture_size(pair.left);
    if (picture.ok() && whole.ok()) return FirstPicture{pair.left, *whole, picture->width(), picture->height()};
    if (first.ok()) first = picture.ok() ? whole.status() : picture.status();
  }
  return first;
}

}  // namespace

Result<std::unique_ptr<StereoSource>> open_left_pictures(PictureSet set, const std::string& calibration_path) {
  for (PicturePair& pair : set.pairs) pair.right.clear();
  set.alone.clear();
  set.unseen.clear();
  set.max_pixels = vision::kReducedPixels;
  const auto first = first_picture(set);
  if (!first.ok()) return first.status();
  const auto& [path, size, width, height] = *first;
  std::string note;
  if (width != size.width) note = ", reduced from " + size_text(size.width, size.height);
  auto calibration = load_calibration(calibration_path.empty() ? set.folder.string() : calibration_path);
  if (calibration.reason() == Reason::NO_SUCH_FILE && calibration_path.empty()) {
    const bool said = set.focal_length > 0;
    calibration = undistorted_camera(size.width, size.height,
                                     said ? set.focal_length : kUsualFocalLength * std::max(size.width, size.height));
    note += ", of unknown calibration: a focal length of " +
            std::to_string(static_cast<int>(calibration->left.fx * width / size.width)) + " px is " +
            (said ? "what they say themselves" : "taken for granted");
  }
  if (!calibration.ok()) return calibration.status();
  calibration->right = {};
  calibration->T_right_left = {};
  if (calibration->width == 0) calibration->width = size.width, calibration->height = size.height;
  if (calibration->width != size.width || calibration->height != size.height)
    return {Reason::BAD_SIZE, "the calibration is of pictures of " +
                                  size_text(calibration->width, calibration->height) + ", but " + path.string() +
                                  " has " + size_text(size.width, size.height)};
  const StereoCalibration of_reduced = vision::reduced(*calibration, width, height);
  auto rectifier = vision::Rectifier::make(of_reduced, width, height);
  if (!rectifier.ok()) return {rectifier.reason(), path.string() + ": " + rectifier.status().message()};
  return std::unique_ptr<StereoSource>(
      std::make_unique<FolderSource>(std::move(set), *calibration, std::move(*rectifier), std::move(note)));
}

Result<std::unique_ptr<StereoSource>> open_pictures(PictureSet set, const std::string& calibration_path) {
  auto calibration = load_calibration(calibration_path);
  if (calibration.reason() == Reason::NO_SUCH_FILE)
    return {Reason::NO_SUCH_FILE, calibration.status().message() + "; --calibration FILE names one elsewhere"};
  if (!calibration.ok()) return calibration.status();
  if (set.pairs.front().right.empty()) {
    calibration->right = {};
    calibration->T_right_left = {};
  } else if (calibration->mono()) {
    return {Reason::NOT_STEREO, calibration_path + " is the calibration of one camera, but " +
                                    set.pairs.front().right.string() + " is the other eye's"};
  }
  const auto first = first_size(set.pairs);
  if (!first.ok()) return first.status();
  const auto& [path, size] = *first;
  auto rectifier = vision::Rectifier::make(*calibration, size.width, size.height);
  if (!rectifier.ok())
    return {rectifier.reason(), calibration_path + ", for " + path.string() + ": " + rectifier.status().message()};
  calibration->width = size.width;
  calibration->height = size.height;
  return std::unique_ptr<StereoSource>(
      std::make_unique<FolderSource>(std::move(set), *calibration, std::move(*rectifier)));
}

Result<std::pair<fs::path, fs::path>> find_eyes(const fs::path& folder, EyePlaces places) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return {Reason::NO_SUCH_FILE, folder.string() + " is no folder"};
  std::string tried;
  for (const auto& [left, right] : places) {
    if (fs::is_directory(folder / left, error) && fs::is_directory(folder / right, error))
      return std::pair{folder / left, folder / right};
    tried += std::string(tried.empty() ? "" : ", ") + left + " and " + right;
  }
  for (const auto& [left, right] : places)
    if (fs::is_directory(folder / left, error)) return std::pair{folder / left, fs::path()};
  return {Reason::NO_SUCH_FILE, folder.string() + " has none of: " + tried};
}

}  // namespace relmap::capture
