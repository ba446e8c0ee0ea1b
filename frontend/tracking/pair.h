// A stereo pair made ready to be tracked through.
#pragma once

#include <memory>

#include "frontend/vision/pyramid.h"

namespace relmap::tracking {

struct Pair {
  vision::Image picture;  // the left one, rectified, as it came
  // Brought to the same exposure (vision/exposure.h). Without levels: that eye sees nothing.
  vision::Pyramid left, right;

  bool sees_left() const { return left.levels() > 0; }
  bool sees_right() const { return right.levels() > 0; }
};

// Of one eye, from its rectified picture; the two may be made on two threads. An empty picture sees nothing.
vision::Pyramid prepare_eye(vision::ImageView picture);

std::shared_ptr<const Pair> prepare_pair(vision::Image left, vision::ImageView right);

}  // namespace relmap::tracking
