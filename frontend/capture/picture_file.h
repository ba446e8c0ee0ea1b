// One picture on disk: PNG, JPEG or PGM, grey or colour, 8 or 16 bit, as grey of 8 bit.
#pragma once

#include <filesystem>
#include <string>

#include "frontend/vision/image.h"
#include "frontend/vision/picture.h"
#include "proto/base/status.h"

namespace relmap::capture {

// ".jpg" of photo.JPG.
std::string lower_ending(const std::filesystem::path& path);
// By the ending, in any case: .png, .jpg, .jpeg, .pgm.
bool is_picture_name(const std::filesystem::path& path);

// Of 16 bits a PNG gives the high byte, whatever range its camera filled; a PGM names its largest value, which becomes
// white. The message names the file. NO_SUCH_FILE, IO_ERROR, NOT_A_PICTURE (by its bytes, not its ending),
// PICTURE_DAMAGED, PICTURE_TOO_LARGE (limits: frontend/vision/picture.h; a PGM: the same bytes).
// `max_pixels`: reduced until it has at most so many; 0: as it is.
Result<vision::Image> read_picture(const std::filesystem::path& path, double max_pixels = 0);

// From the header alone, nothing is decoded. Reasons as above.
Result<vision::PictureSize> read_picture_size(const std::filesystem::path& path);

// For who needs more of the file than its size: the bytes, at most so many of them, and the size in them. Reasons as
// above.
Result<Bytes> read_picture_bytes(const std::filesystem::path& path, std::size_t most = vision::kMaxPictureBytes + 1);
Result<vision::PictureSize> size_in_bytes(const std::filesystem::path& path, ByteSpan file);

}  // namespace relmap::capture
