// Whether a PNG is whole, before it is decoded: OpenCV lets libpng complain on standard error, where nobody knows of
// which file.
#pragma once

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::vision {

// Of bytes that begin with the signature: chunks up to IEND, each as long as it says and with the CRC that it names.
// PICTURE_DAMAGED.
Status check_png(ByteSpan file);

}  // namespace relmap::vision
