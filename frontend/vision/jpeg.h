// JPEG decoded by libjpeg itself: OpenCV hides that libjpeg met damage, and lets it complain on standard error, where
// nobody knows of which file.
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::vision {

// Grey; `reduction` 1, 2, 4 or 8 in each direction. What cameras write wrong without harm to a pixel is passed over.
// PICTURE_DAMAGED, with libjpeg's words; UNSUPPORTED: CMYK.
Result<Image> decode_jpeg(ByteSpan file, int reduction);

}  // namespace relmap::vision
