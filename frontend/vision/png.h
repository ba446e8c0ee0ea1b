// Checks that a PNG is complete before it is decoded: OpenCV lets libpng write to standard error without the file's
// name.
#pragma once

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::vision {

// Checks the chunks up to IEND: each must have the length and the CRC that it states. `file` begins with the signature
// of a PNG. PICTURE_DAMAGED otherwise.
Status check_png(ByteSpan file);

}  // namespace relmap::vision
