// Grey pictures, 8 bit, owned or borrowed. OpenCV stays behind the .cc files.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace relmap::vision {

// Grey levels up to kBlack and from kWhite on may have been clipped.
inline constexpr int kBlack = 5, kWhite = 250;

// Borrowed pixels, in rows `stride` bytes apart. The owner must outlive the view.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0, stride = 0;

  bool empty() const { return width == 0 || height == 0; }
  const std::uint8_t* row(int y) const { return data + static_cast<std::ptrdiff_t>(y) * stride; }
  std::uint8_t at(int x, int y) const { return row(y)[x]; }
};

class Image {
 public:
  Image() = default;
  Image(int width, int height)
      : pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)), width_(width), height_(height) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty(); }
  std::uint8_t* row(int y) { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  const std::uint8_t* row(int y) const { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  std::uint8_t at(int x, int y) const { return row(y)[x]; }
  operator ImageView() const { return {pixels_.data(), width_, height_, width_}; }  // NOLINT: a view of itself

 private:
  std::vector<std::uint8_t> pixels_;
  int width_ = 0, height_ = 0;
};

inline Image copy_of(ImageView picture) {
  Image image(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) std::copy_n(picture.row(y), picture.width, image.row(y));
  return image;
}

// Compares byte for byte. Two exposures of one scene are never the same picture, since their noise differs. False for
// empty pictures.
inline bool same_picture(ImageView a, ImageView b) {
  if (a.width != b.width || a.height != b.height || a.empty()) return false;
  for (int y = 0; y < a.height; ++y)
    if (!std::equal(a.row(y), a.row(y) + a.width, b.row(y))) return false;
  return true;
}

// Bilinear interpolation; (x, y) and its neighbours to the right and below must lie in the picture.
inline float sample(ImageView image, float x, float y) {
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const std::uint8_t *above = image.row(y0) + x0, *below = image.row(y0 + 1) + x0;
  return (1 - fy) * ((1 - fx) * above[0] + fx * above[1]) + fy * ((1 - fx) * below[0] + fx * below[1]);
}

}  // namespace relmap::vision
