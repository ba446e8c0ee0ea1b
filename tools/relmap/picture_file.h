// Pictures as files: their bytes, and how large they say they are.
#pragma once

#include <string>
#include <string_view>

#include "proto/status.h"

namespace relmap::cli {

// NO_SUCH_FILE; PICTURE_TOO_LARGE: more than the 16 MB that a daemon takes.
Result<std::string> read_picture_file(const std::string& path);

struct PixelSize {
  int width = 0, height = 0;
};
// From the header of a JPEG or PNG. NOT_A_PICTURE, PICTURE_DAMAGED.
Result<PixelSize> pixel_size(std::string_view file);

}  // namespace relmap::cli
