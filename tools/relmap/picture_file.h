// Pictures as files: their bytes, and how large they say they are.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "client/map_types.h"
#include "proto/base/status.h"

namespace relmap::cli {

// NO_SUCH_FILE; PICTURE_TOO_LARGE: more than the 16 MB that a daemon takes.
Result<std::string> read_picture_file(const std::string& path);

// DIR/3-120.jpg for frame 3:120; makes the folder. IO_ERROR, with the path and why.
Status write_thumbnails(std::span<const client::PlaceMatch> places, const std::string& folder);

struct PixelSize {
  int width = 0, height = 0;
};
// From the header of a JPEG or PNG. NOT_A_PICTURE, PICTURE_DAMAGED.
Result<PixelSize> pixel_size(std::string_view file);

}  // namespace relmap::cli
