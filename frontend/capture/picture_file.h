// Reads a picture from disk (PNG, JPEG or PGM; grey or colour; 8 or 16 bit) as 8-bit grey.
#pragma once

#include <filesystem>
#include <string>

#include "frontend/vision/image.h"
#include "frontend/vision/picture.h"
#include "proto/base/status.h"

namespace relmap::capture {

// ".jpg" of photo.JPG.
std::string lower_ending(const std::filesystem::path& path);
// Whether the name ends in .png, .jpg, .jpeg or .pgm, in upper or lower case.
bool is_picture_name(const std::filesystem::path& path);

// Reads a picture and reduces it to at most `max_pixels` (0: no limit). Of a 16-bit PNG it takes the high byte,
// whatever range the camera used; in a PGM, the maximum value that its header states becomes white. NO_SUCH_FILE,
// IO_ERROR, NOT_A_PICTURE (by its bytes, not its name), PICTURE_DAMAGED, PICTURE_TOO_LARGE (limits:
// frontend/vision/picture.h; for a PGM the limit of bytes). The message names the file.
Result<vision::Image> read_picture(const std::filesystem::path& path, double max_pixels = 0);

// Reads the size from the header; nothing is decoded. The reasons of read_picture().
Result<vision::PictureSize> read_picture_size(const std::filesystem::path& path);

// For callers that need more of the file than its size: its first bytes, and the size that they state. The reasons of
// read_picture().
Result<Bytes> read_picture_bytes(const std::filesystem::path& path,
                                 std::size_t max_bytes = vision::kMaxPictureBytes + 1);
Result<vision::PictureSize> size_in_bytes(const std::filesystem::path& path, ByteSpan file);

}  // namespace relmap::capture
