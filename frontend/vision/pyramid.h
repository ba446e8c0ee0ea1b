// A picture and its halvings: level i + 1 averages 2 x 2 pixels of level i.
#pragma once

#include <vector>

#include "frontend/vision/image.h"

namespace relmap::vision {

inline constexpr int kPyramidLevels = 4;

class Pyramid {
 public:
  Pyramid() = default;
  // Makes at most `max_levels`, fewer if a side would fall below 32 pixels, but at least one.
  explicit Pyramid(Image picture, int max_levels = kPyramidLevels);
  explicit Pyramid(ImageView picture, int max_levels = kPyramidLevels) : Pyramid(copy_of(picture), max_levels) {}

  int levels() const { return static_cast<int>(images_.size()); }
  ImageView level(int i) const { return images_[static_cast<std::size_t>(i)]; }

 private:
  std::vector<Image> images_;
};

Image halve(ImageView image);  // the mean of each 2 x 2 pixels; an odd last row or column is left out

// Pixel coordinates between the picture and a level; pixel (0, 0) is the centre of the top left pixel in both.
inline float to_level(float u, int level) { return (u + 0.5F) / static_cast<float>(1 << level) - 0.5F; }
inline float from_level(float x, int level) { return (x + 0.5F) * static_cast<float>(1 << level) - 0.5F; }

}  // namespace relmap::vision
