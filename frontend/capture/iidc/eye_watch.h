// Notices that one eye of a camera is dead: dark, blank, or frozen while the other one sees.
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
  // EYE_DEAD, which one and why. Where both are blank it is dark, and no eye is dead.
  struct Verdict {
    Status left, right;
  };
  Verdict look(vision::ImageView left, vision::ImageView right);

 private:
  struct Eye {
    std::vector<std::uint8_t> grid;
    int frozen = 0;  // pairs in a row in which it alone did not change
  };
  std::array<Eye, 2> eyes_;
};

}  // namespace relmap::iidc
