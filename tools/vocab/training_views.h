// Many pictures of one: a photograph is larger than what a robot's camera sees at once, so several cameras look at it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "frontend/vision/image.h"
#include "proto/base/status.h"

namespace relmap::vocab {

inline constexpr int kViewWidth = 512, kViewHeight = 384;

// At most `most` views of the picture in a file (JPEG, PNG or WebP), by the room that it has for different ones: each
// looks at a part of it, at a scale of its own, a little aslant. One of at most a camera's size is its own only view.
// The same file gives the same views. NOT_A_PICTURE.
Result<std::vector<vision::Image>> training_views(const std::string& file, std::size_t most);

}  // namespace relmap::vocab
