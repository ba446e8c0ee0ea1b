// Portable grey maps (netpbm's PGM, binary): the picture format that many data sets have and no browser reads.
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::capture {

// "P5", width, height and largest value as text with # comments, then the rows: a byte a pixel, or two, big-endian,
// where the largest value is above 255.
struct PgmHeader {
  int width = 0, height = 0;
  int largest = 0;         // 1..65535: white
  std::size_t pixels = 0;  // where they begin
};

bool is_pgm(ByteSpan file);

// PICTURE_DAMAGED: no header, or fewer pixels than it declares; PICTURE_TOO_LARGE: a side above 16384.
Result<PgmHeader> read_pgm_header(ByteSpan file);

// 0..largest becomes 0..255. Reasons as above.
Result<vision::Image> decode_pgm(ByteSpan file);

}  // namespace relmap::capture
