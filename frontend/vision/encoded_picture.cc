#include "frontend/vision/encoded_picture.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "frontend/vision/picture.h"
#include "frontend/vision/pyramid.h"

namespace relmap::vision {

namespace {

cv::Mat borrowed(ImageView picture) {
  return {picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.data),
          static_cast<std::size_t>(picture.stride)};
}

// Encodes at the first of the qualities that makes the JPEG small enough; empty if none does.
Bytes encode(const cv::Mat& picture, std::initializer_list<int> qualities, std::size_t max_bytes) {
  for (const int quality : qualities) {
    Bytes bytes;
    if (cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, quality}) && bytes.size() <= max_bytes)
      return bytes;
  }
  return {};
}

}  // namespace

Bytes encode_picture(ImageView picture, std::size_t max_bytes) {
  Image halved;
  ImageView view = picture;
  for (int n = 0; n <= kMaxHalvings && !view.empty(); ++n) {
    if (static_cast<double>(view.width) * view.height <= kReducedPixels)
      if (Bytes bytes = encode(borrowed(view), {60, 50, 40, 30}, max_bytes); !bytes.empty()) return bytes;
    halved = halve(view);
    view = halved;
  }
  return {};
}

Bytes make_thumbnail(ImageView picture) {
  const double scale = std::min(1.0, static_cast<double>(kThumbnailWidth) / picture.width);
  const auto scaled = [scale](int side) { return std::max(1, static_cast<int>(std::lround(scale * side))); };
  cv::Mat small;
  cv::resize(borrowed(picture), small, {scaled(picture.width), scaled(picture.height)}, 0, 0, cv::INTER_AREA);
  return encode(small, {75, 60, 45, 30, 15}, kMaxThumbnailBytes);
}

Bytes thumbnail_of(ByteSpan jpeg) {
  if (jpeg.size() <= kMaxThumbnailBytes) return {jpeg.begin(), jpeg.end()};
  const auto size = picture_size(jpeg);
  if (!size.ok() || double{1} * size->width * size->height > kMaxKeyframePixels) return {};
  const auto picture = decode_picture(jpeg);
  return picture.ok() ? make_thumbnail(picture->grey) : Bytes{};
}

}  // namespace relmap::vision
