// Pictures as the bytes of JPEG and PNG files. Internal to client/.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "proto/base/status.h"

namespace relmap::client {

bool is_png(const std::string& file);

// The picture in colour (BGR), as it is stored: without the turn that a camera may have noted in it. NOT_A_PICTURE,
// PICTURE_DAMAGED.
Result<cv::Mat> decode_picture(const std::string& file);

// The same file, or, if the picture is wider than `width` pixels and its file large, a JPEG of this width.
// NOT_A_PICTURE; PICTURE_DAMAGED.
Result<std::string> reduced_picture(const std::string& file, int width);

}  // namespace relmap::client
