// Brightness and contrast of a picture, and pictures brought to the same: the two eyes expose apart, and each exposes
// anew from picture to picture.
#pragma once

#include "frontend/vision/image.h"

namespace relmap::vision {

struct Exposure {
  double mean = 0, deviation = 0;  // grey levels, over every second pixel of every second row

  // Nothing to see: covered, black, or white all over.
  bool blind() const { return deviation < 4; }
};
Exposure measure_exposure(ImageView picture);

// `picture`, exposed as `exposure` says, with mean 112 and deviation 48, cut to 0..255. Contrast grows or shrinks by no
// more than four times.
Image standardise(ImageView picture, const Exposure& exposure);

}  // namespace relmap::vision
