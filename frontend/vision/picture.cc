#include "frontend/vision/picture.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "frontend/vision/jpeg.h"
#include "proto/base/big_endian.h"

namespace relmap::vision {

namespace {

// libjpeg holds all coefficients of a JPEG with several scans in memory at once.
constexpr double kMaxCoefficientBytes = 96e6;
constexpr int kMaxScans = 100;

Result<PictureSize> refuse_if_large(PictureSize size) {
  if (size.width < 1 || size.height < 1)
    return {Reason::PICTURE_DAMAGED, "declares " + std::to_string(size.width) + " x " + std::to_string(size.height)};
  const double megapixels = 1e-6 * size.width * size.height;
  const double limit = size.png ? kMaxPngMegapixels : kMaxJpegMegapixels;
  if (megapixels > limit)
    return {Reason::PICTURE_TOO_LARGE, "declares " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                                           " pixels; at most " + std::to_string(static_cast<int>(limit)) +
                                           " megapixels"};
  return size;
}

Result<PictureSize> png_size(ByteSpan file) {
  // Signature, length of the first chunk, its type, width, height (ISO/IEC 15948, 11.2.2).
  static constexpr std::array<std::uint8_t, 4> kHeader{'I', 'H', 'D', 'R'};
  if (file.size() < 33 || !std::equal(kHeader.begin(), kHeader.end(), file.begin() + 12))
    return {Reason::PICTURE_DAMAGED, "PNG without a header"};
  const std::uint32_t width = big_endian(file.subspan(16, 4)), height = big_endian(file.subspan(20, 4));
  constexpr std::uint32_t kMax = 1u << 30;
  if (width > kMax || height > kMax)
    return {Reason::PICTURE_TOO_LARGE,
            "declares " + std::to_string(width) + " x " + std::to_string(height) + " pixels"};
  return refuse_if_large({static_cast<int>(width), static_cast<int>(height), true});
}

// Checks the chunks of a PNG up to IEND before it is decoded: each must have the length and the CRC that it states.
// OpenCV lets libpng write to standard error without the file's name.
Status check_png(ByteSpan file) {
  constexpr std::size_t kSignature = 8, kFrame = 12;  // length, type and CRC of a chunk
  for (std::size_t at = kSignature; at + kFrame <= file.size();) {
    const std::size_t length = big_endian(file.subspan(at, 4));
    if (length > file.size() - at - kFrame) break;
    const std::string type(file.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                           file.begin() + static_cast<std::ptrdiff_t>(at) + 8);
    if (crc32_z(0, &file[at + 4], 4 + length) != big_endian(file.subspan(at + 8 + length, 4)))
      return {Reason::PICTURE_DAMAGED,
              "PNG is damaged in the chunk of " + std::to_string(length) + " bytes at byte " + std::to_string(at)};
    if (type == "IEND") return {};
    at += kFrame + length;
  }
  return {Reason::PICTURE_DAMAGED, "PNG is cut short"};
}

// Walks the markers of a JPEG (ITU T.81, B): finds its size, whether it is complete, and how much memory decoding
// takes.
class JpegWalk {
 public:
  explicit JpegWalk(ByteSpan file) : file_(file) {}

  Result<PictureSize> size() {
    if (Status status = walk(/*whole=*/false); !status.ok()) return status;
    return refuse_if_large({width_, height_, false});
  }

  Status check_whole() {
    if (Status status = walk(/*whole=*/true); !status.ok()) return status;
    if (several_scans_ && coefficient_bytes_ > kMaxCoefficientBytes)
      return {Reason::PICTURE_TOO_LARGE,
              "a progressive JPEG of " + std::to_string(width_) + " x " + std::to_string(height_) + " pixels"};
    return {};
  }

 private:
  static Status damaged(const char* what) { return {Reason::PICTURE_DAMAGED, what}; }

  // Returns the next marker at or after at_ and moves at_ behind it; 0 at the end of the file.
  int next_marker() {
    while (at_ + 1 < file_.size()) {
      const int code = file_[at_ + 1];
      if (file_[at_] == 0xff && code != 0 && code != 0xff && !(code >= 0xd0 && code <= 0xd7)) {
        at_ += 2;
        return code;
      }
      ++at_;
    }
    at_ = file_.size();
    return 0;
  }

  Status walk(bool whole) {
    at_ = 2;
    int scans = 0;
    while (const int code = next_marker()) {
      if (code == 0xd9) {  // end of image
        if (scans == 0) return damaged("JPEG without a scan");
        return {};
      }
      if (code == 0x01 || code == 0xd8) continue;  // markers without a body
      if (at_ + 2 > file_.size()) return damaged("JPEG ends within a marker");
      const std::size_t length = big_endian(file_.subspan(at_, 2));
      if (length < 2 || at_ + length > file_.size()) return damaged("JPEG ends within a segment");
      const ByteSpan body = file_.subspan(at_ + 2, length - 2);
      const bool frame = code >= 0xc0 && code <= 0xcf && code != 0xc4 && code != 0xc8 && code != 0xcc;
      if (frame) {
        if (components_ > 0) return damaged("JPEG with two frame headers");
        if (Status status = read_frame(code, body); !status.ok()) return status;
        if (!whole) return {};
      }
      if (code == 0xda) {
        if (components_ == 0) return damaged("JPEG without a frame header");
        if (++scans > kMaxScans) return damaged("JPEG of too many scans");
        if (scans > 1 || (!body.empty() && body[0] < components_)) several_scans_ = true;
      }
      at_ += length;
    }
    return damaged(components_ == 0 ? "JPEG without a frame header" : "JPEG is cut short");
  }

  Status read_frame(int code, ByteSpan body) {
    if (body.size() < 6) return damaged("JPEG with a short frame header");
    height_ = static_cast<int>(big_endian(body.subspan(1, 2)));
    width_ = static_cast<int>(big_endian(body.subspan(3, 2)));
    components_ = body[5];
    if (components_ == 0 || body.size() < 6 + 3u * static_cast<unsigned>(components_))
      return damaged("JPEG with a short frame header");
    int max_area = 1;
    double samples = 0;
    for (int i = 0; i < components_; ++i) {
      const int factors = body[7 + 3 * static_cast<std::size_t>(i)];
      const int area = std::max(1, factors >> 4) * std::max(1, factors & 15);
      max_area = std::max(max_area, area);
      samples += area;
    }
    coefficient_bytes_ = 2.0 * width_ * height_ * samples / max_area;
    several_scans_ = code == 0xc2 || code == 0xc6 || code == 0xca || code == 0xce;
    return {};
  }

  ByteSpan file_;
  std::size_t at_ = 0;
  int width_ = 0, height_ = 0, components_ = 0;
  bool several_scans_ = false;
  double coefficient_bytes_ = 0;
};

bool is_png(ByteSpan file) {
  static constexpr std::array<std::uint8_t, 8> kSignature{0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a};
  return file.size() >= 8 && std::equal(kSignature.begin(), kSignature.end(), file.begin());
}

bool is_jpeg(ByteSpan file) { return file.size() >= 3 && file[0] == 0xff && file[1] == 0xd8 && file[2] == 0xff; }

Image to_image(const cv::Mat& grey) {
  Image image(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y) std::copy_n(grey.ptr<std::uint8_t>(y), grey.cols, image.row(y));
  return image;
}

Result<Image> decode_png(ByteSpan file) {
  if (Status status = check_png(file); !status.ok()) return status;
  try {
    const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<std::uint8_t*>(file.data()));
    const cv::Mat grey = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (grey.empty() || grey.type() != CV_8UC1) return {Reason::PICTURE_DAMAGED, "its pixels cannot be decoded"};
    return to_image(grey);
  } catch (const std::exception& error) {
    return {Reason::PICTURE_DAMAGED, error.what()};
  }
}

}  // namespace

Result<PictureSize> picture_size(ByteSpan file) {
  if (file.size() > kMaxPictureBytes)
    return {Reason::PICTURE_TOO_LARGE,
            std::to_string(file.size()) + " bytes; at most " + std::to_string(kMaxPictureBytes)};
  if (is_png(file)) return png_size(file);
  if (is_jpeg(file)) return JpegWalk(file).size();
  return {Reason::NOT_A_PICTURE, "neither JPEG nor PNG"};
}

Result<DecodedPicture> decode_picture(ByteSpan file, double max_pixels) {
  const auto size = picture_size(file);
  if (!size.ok()) return size.status();
  int reduction = 1;
  if (!size->png) {
    if (Status status = JpegWalk(file).check_whole(); !status.ok()) return status;
    const double pixels = static_cast<double>(size->width) * size->height;
    while (max_pixels > 0 && reduction < 8 && pixels / (4.0 * reduction * reduction) >= max_pixels) reduction *= 2;
  }
  auto decoded = size->png ? decode_png(file) : decode_jpeg(file, reduction);
  if (!decoded.ok()) return decoded.status();
  Image grey = reduce(std::move(*decoded), max_pixels);
  const double scale = static_cast<double>(grey.width()) / size->width;
  return DecodedPicture{std::move(grey), scale};
}

Image reduce(Image grey, double max_pixels) {
  const double pixels = static_cast<double>(grey.width()) * grey.height();
  if (max_pixels <= 0 || pixels <= max_pixels) return grey;
  const double factor = std::sqrt(max_pixels / pixels);
  const cv::Mat whole(grey.height(), grey.width(), CV_8UC1, grey.row(0));
  const cv::Size size(std::max(1, static_cast<int>(grey.width() * factor)),
                      std::max(1, static_cast<int>(grey.height() * factor)));
  cv::Mat smaller;
  cv::resize(whole, smaller, size, 0, 0, cv::INTER_AREA);
  return to_image(smaller);
}

StereoCamera reduced(const StereoCamera& camera, int width, int height) {
  const double sx = static_cast<double>(width) / camera.width, sy = static_cast<double>(height) / camera.height;
  StereoCamera result = camera;
  result.f = camera.f * sx;
  result.cx = (camera.cx + 0.5) * sx - 0.5;
  result.cy = (camera.cy + 0.5) * sy - 0.5;
  result.width = width;
  result.height = height;
  return result;
}

StereoCalibration reduced(const StereoCalibration& calibration, int width, int height) {
  const double sx = static_cast<double>(width) / calibration.width;
  const double sy = static_cast<double>(height) / calibration.height;
  StereoCalibration result = calibration;
  for (RawCamera* eye : {&result.left, &result.right}) {
    if (*eye == RawCamera{}) continue;
    eye->fx *= sx;
    eye->fy *= calibration.rectified ? sx : sy;  // keeps square pixels square
    eye->cx = (eye->cx + 0.5) * sx - 0.5;
    eye->cy = (eye->cy + 0.5) * sy - 0.5;
  }
  result.width = width;
  result.height = height;
  return result;
}

}  // namespace relmap::vision
