// Takes several views of one photograph, since it shows more than a robot's camera sees at once.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "frontend/vision/image.h"
#include "proto/base/status.h"

namespace relmap::vocab {

inline constexpr int kViewWidth = 512, kViewHeight = 384;

// At most `max_views` views of the picture in a file (JPEG, PNG or WebP), the more the larger it is. Each view is a
// part of the picture, at a scale of its own, a little aslant. A picture no larger than a camera's is its own only
// view. The same file gives the same views. NOT_A_PICTURE.
Result<std::vector<vision::Image>> training_views(const std::string& file, std::size_t max_views);

}  // namespace relmap::vocab
