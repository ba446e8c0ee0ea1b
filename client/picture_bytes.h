// Pictures as the bytes of JPEG and PNG files. Internal to client/.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::client {

bool is_png(const std::string& file);

struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> bgr;  // row by row
};
// The picture in colour, as it is stored: without the turn that a camera may have noted in it. NOT_A_PICTURE,
// PICTURE_DAMAGED.
Result<Pixels> decode_picture(const std::string& file);

// The same file, or, if the picture is wider than `width` pixels and its file large, a JPEG of this width.
// NOT_A_PICTURE; PICTURE_DAMAGED.
Result<std::string> reduced_picture(const std::string& file, int width);

}  // namespace relmap::client
