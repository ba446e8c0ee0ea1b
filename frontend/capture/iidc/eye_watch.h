// Detects a dead eye of a camera: one that is dark, blank, or frozen while the other one sees.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "frontend/vision/image.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// Looks at a grid of pixels of each pair. Not thread-safe.
class EyeWatch {
 public:
  // EYE_DEAD for a dead eye, with the cause. If both eyes are blank, it is dark, and neither is dead.
  struct Verdict {
    Status left, right;
  };
  Verdict look(vision::ImageView left, vision::ImageView right);

 private:
  struct Eye {
    std::vector<std::uint8_t> grid;
    int frozen = 0;  // consecutive pairs in which only the other eye changed
  };
  std::array<Eye, 2> eyes_;
};

}  // namespace relmap::iidc
