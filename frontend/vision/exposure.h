// Measures and normalises brightness and contrast of pictures. The two eyes expose independently of each other, and the
// exposure of each changes from picture to picture.
#pragma once

#include "frontend/vision/image.h"

namespace relmap::vision {

struct Exposure {
  double mean = 0, deviation = 0;  // grey levels, over every second pixel of every second row

  // There is nothing to see: the lens is covered, or the picture is black or white all over.
  bool blind() const { return deviation < 4; }
};
Exposure measure_exposure(ImageView picture);

// Scales `picture` to mean 112 and deviation 48, clamped to 0..255. `exposure` is that of `picture`. The contrast
// changes by a factor of four at most.
Image standardise(ImageView picture, const Exposure& exposure);

}  // namespace relmap::vision
