// Reads portable grey maps (netpbm's binary PGM), which many data sets use.
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::capture {

// A file has "P5", width, height and maximum value as text with # comments, then the rows: one byte a pixel, or two
// (big-endian) if the maximum value is above 255.
struct PgmHeader {
  int width = 0, height = 0;
  int max_value = 0;       // 1..65535, the value of white
  std::size_t pixels = 0;  // offset of the first pixel
};

bool is_pgm(ByteSpan file);

// PICTURE_DAMAGED if there is no header, or there are fewer pixels than it declares; PICTURE_TOO_LARGE if a side is
// above 16384 pixels.
Result<PgmHeader> read_pgm_header(ByteSpan file);

// Scales 0..max_value to 0..255. The reasons of read_pgm_header().
Result<vision::Image> decode_pgm(ByteSpan file);

}  // namespace relmap::capture
