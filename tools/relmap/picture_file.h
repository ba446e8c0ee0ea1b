// Picture files: their bytes, and the size that their header tells.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "client/map_types.h"
#include "proto/base/status.h"

namespace relmap::cli {

// The bytes of the file. NO_SUCH_FILE; NOT_A_PICTURE: it is a folder; PICTURE_TOO_LARGE if it has more than the 16 MB
// that a daemon takes.
Result<std::string> read_picture_file(const std::string& path);

// Writes a thumbnail for each place, FOLDER/3-120.jpg for frame 3:120, and creates the folder. IO_ERROR.
Status write_thumbnails(std::span<const client::PlaceMatch> places, const std::string& folder);

struct PixelSize {
  int width = 0, height = 0;
};
// The size of a JPEG or PNG, read from its header. NOT_A_PICTURE, PICTURE_DAMAGED.
Result<PixelSize> pixel_size(std::string_view file);

}  // namespace relmap::cli
