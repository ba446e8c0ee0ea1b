// Decodes JPEGs with libjpeg directly: OpenCV hides that libjpeg found damage, and lets it write to standard error
// without the file's name.
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::vision {

// Decodes to grey, smaller by `reduction` (1, 2, 4 or 8) in each direction. Mistakes that cameras make and that harm no
// pixel are ignored. PICTURE_DAMAGED, with libjpeg's message; UNSUPPORTED for CMYK.
Result<Image> decode_jpeg(ByteSpan file, int reduction);

}  // namespace relmap::vision
