#include "frontend/capture/stereo_source.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "frontend/capture/picture_folder.h"
#include "frontend/vision/picture.h"
#include "proto/calibration.h"

namespace relmap {

namespace fs = std::filesystem;

namespace {

Result<Bytes> read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return {Reason::NO_SUCH_FILE, path.string() + " cannot be opened"};
  // One byte more than a picture may have is enough to refuse it.
  Bytes bytes(kMaxPictureBytes + 1);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (in.bad()) return {Reason::IO_ERROR, path.string() + " cannot be read"};
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

Status named(const fs::path& path, const Status& status) {
  return {status.reason(), path.string() + ": " + status.message()};
}

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

Result<Image> read_picture(const fs::path& path) {
  const auto bytes = read_file(path);
  if (!bytes.ok()) return bytes.status();
  auto picture = decode_picture(*bytes, 0);
  if (!picture.ok()) return named(path, picture.status());
  return std::move(picture->grey);
}

class FolderSource : public StereoSource {
 public:
  FolderSource(std::string kind, fs::path folder, std::vector<PicturePair> pairs, Rectifier rectifier)
      : kind_(std::move(kind)),
        folder_(std::move(folder)),
        pairs_(std::move(pairs)),
        rectifier_(std::move(rectifier)) {}

  const Rectifier& rectifier() const override { return rectifier_; }
  std::size_t count() const override { return pairs_.size(); }
  std::string describe() const override {
    return kind_ + ' ' + folder_.string() + ": " + std::to_string(pairs_.size()) + " pairs of " +
           size_text(camera().width, camera().height) + (rectifier_.passes_through() ? "" : ", to be rectified");
  }
  void skip_before(std::int64_t time_us) override {
    while (next_ < pairs_.size() && pairs_[next_].time_us < time_us) ++next_;
  }
  Result<std::optional<StereoFrame>> next() override {
    if (next_ >= pairs_.size()) return std::optional<StereoFrame>();
    const PicturePair& pair = pairs_[next_++];
    StereoFrame frame;
    frame.time_us = pair.time_us;
    for (const bool left : {true, false}) {
      const fs::path& path = left ? pair.left : pair.right;
      auto raw = read_picture(path);
      if (!raw.ok()) return raw.status();
      if (raw->width() != camera().width || raw->height() != camera().height)
        return {Reason::BAD_SIZE, path.string() + ": a picture of " + size_text(raw->width(), raw->height()) +
                                      " among those of " + size_text(camera().width, camera().height)};
      (left ? frame.left : frame.right) = std::move(*raw);
    }
    return std::optional<StereoFrame>(std::move(frame));
  }

 private:
  std::string kind_;
  fs::path folder_;
  std::vector<PicturePair> pairs_;
  std::size_t next_ = 0;
  Rectifier rectifier_;
};

// The first of the usual places of the two eyes that exists.
Result<std::pair<fs::path, fs::path>> find_eyes(const fs::path& folder,
                                                std::initializer_list<std::pair<const char*, const char*>> places) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return {Reason::NO_SUCH_FILE, folder.string() + " is no folder"};
  std::string tried;
  for (const auto& [left, right] : places) {
    if (fs::is_directory(folder / left, error) && fs::is_directory(folder / right, error))
      return std::pair{folder / left, folder / right};
    tried += std::string(tried.empty() ? "" : ", ") + left + " and " + right;
  }
  return {Reason::NO_SUCH_FILE, folder.string() + " has none of: " + tried};
}

Result<std::unique_ptr<StereoSource>> open_folder(const std::string& kind, const fs::path& folder,
                                                  std::vector<PicturePair> pairs, const std::string& calibration_path) {
  auto calibration = load_calibration(calibration_path);
  if (!calibration.ok()) return calibration.status();
  if (calibration->mono()) return {Reason::NOT_STEREO, calibration_path + " is the calibration of one camera"};
  const auto first = read_file(pairs.front().left);
  if (!first.ok()) return first.status();
  const auto size = picture_size(*first);
  if (!size.ok()) return named(pairs.front().left, size.status());
  auto rectifier = Rectifier::make(*calibration, size->width, size->height);
  if (!rectifier.ok()) return rectifier.status();
  return std::unique_ptr<StereoSource>(
      std::make_unique<FolderSource>(kind, folder, std::move(pairs), std::move(*rectifier)));
}

}  // namespace

Result<StereoFrame> rectify(const Rectifier& rectifier, StereoFrame raw) {
  if (rectifier.passes_through()) return raw;
  auto left = rectifier.left(raw.left);
  if (!left.ok()) return left.status();
  auto right = rectifier.right(raw.right);
  if (!right.ok()) return right.status();
  return StereoFrame{std::move(*left), std::move(*right), raw.time_us};
}

Result<std::unique_ptr<StereoSource>> open_kitti(const std::string& path, const FolderOptions& options) {
  const fs::path folder = path;
  const auto eyes =
      find_eyes(folder, {{"image_0", "image_1"}, {"image_00/data", "image_01/data"}, {"image_00", "image_01"}});
  if (!eyes.ok()) return eyes.status();
  auto pairs = pair_up(eyes->first, eyes->second);
  if (!pairs.ok()) return pairs.status();
  if (Status status = set_times(*pairs, folder / "times.txt", false, options.rate_hz); !status.ok()) return status;
  const std::string calibration = options.calibration.empty() ? (folder / "calib.txt").string() : options.calibration;
  return open_folder("KITTI data set", folder, std::move(*pairs), calibration);
}

Result<std::unique_ptr<StereoSource>> open_images(const std::string& path, const FolderOptions& options) {
  const fs::path folder = path;
  const auto eyes = find_eyes(folder, {{"left", "right"},
                                       {"image_0", "image_1"},
                                       {"cam0/data", "cam1/data"},
                                       {"cam0", "cam1"},
                                       {"mav0/cam0/data", "mav0/cam1/data"}});
  if (!eyes.ok()) return eyes.status();
  auto pairs = pair_up(eyes->first, eyes->second);
  if (!pairs.ok()) return pairs.status();
  if (Status status = set_times(*pairs, folder / "times.txt", true, options.rate_hz); !status.ok()) return status;
  return open_folder("pictures in", folder, std::move(*pairs),
                     options.calibration.empty() ? path : options.calibration);
}

}  // namespace relmap
