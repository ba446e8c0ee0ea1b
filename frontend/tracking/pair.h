// A stereo pair prepared for tracking.
#pragma once

#include <memory>

#include "frontend/vision/pyramid.h"

namespace relmap::tracking {

struct Pair {
  vision::Image picture;  // the left one, rectified, with its own exposure
  // Pyramids of the pictures with normalised exposure (vision/exposure.h); without levels if an eye sees nothing.
  vision::Pyramid left, right;

  bool sees_left() const { return left.levels() > 0; }
  bool sees_right() const { return right.levels() > 0; }
};

// The pyramid of one eye's rectified picture; without levels if the picture is empty or blind. Thread-safe.
vision::Pyramid prepare_eye(vision::ImageView picture);

std::shared_ptr<const Pair> prepare_pair(vision::Image left, vision::ImageView right);

}  // namespace relmap::tracking
