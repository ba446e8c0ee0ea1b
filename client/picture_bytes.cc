#include "client/picture_bytes.h"

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "client/drawing.h"

namespace relmap::client {

namespace {
constexpr std::size_t kSmallFile = 200 * 1024;  // bytes; a smaller file is passed on as it is
}

bool is_png(const std::string& file) { return file.starts_with("\x89PNG\r\n\x1a\n"); }

Result<Pixels> decode_picture(const std::string& file) {
  if (!is_png(file) && !file.starts_with("\xff\xd8\xff"))
    return {Reason::NOT_A_PICTURE, "the picture is neither JPEG nor PNG"};
  try {
    const std::vector<std::uint8_t> bytes(file.begin(), file.end());
    const cv::Mat picture = cv::imdecode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (!picture.empty() && picture.isContinuous())
      return Pixels{picture.cols, picture.rows, {picture.datastart, picture.dataend}};
  } catch (const cv::Exception&) {
  }
  return {Reason::PICTURE_DAMAGED, "the picture cannot be read"};
}

Result<Vector2> picture_size(const std::string& file) {
  const auto picture = decode_picture(file);
  if (!picture.ok()) return picture.status();
  return Vector2(picture->width, picture->height);
}

Result<std::string> reduced_picture(const std::string& file, int width) {
  auto picture = decode_picture(file);
  if (!picture.ok()) return picture.status();
  if (file.size() <= kSmallFile || picture->width <= width) return file;
  const cv::Mat whole(picture->height, picture->width, CV_8UC3, picture->bgr.data());
  cv::Mat small;
  const double scale = static_cast<double>(width) / picture->width;
  cv::resize(whole, small, cv::Size(), scale, scale, cv::INTER_AREA);
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, 88}))
    return {Reason::PICTURE_DAMAGED, "the picture cannot be reduced"};
  return std::string(bytes.begin(), bytes.end());
}

}  // namespace relmap::client
