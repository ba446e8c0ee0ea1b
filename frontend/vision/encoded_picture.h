// Pictures made small enough to travel: with a keyframe, to be measured in, and in answers, to be looked at.
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/bytes.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::vision {

inline constexpr std::size_t kMaxThumbnailBytes = 4096;
inline constexpr int kThumbnailWidth = 160;

// A JPEG of at most `max_bytes`, of quality 60 to 30; halved, twice at most, where that is too much or it has more
// than half a megapixel. Empty if that is not enough.
inline constexpr std::size_t kKeyframePictureBytes = 32 * 1024;
static_assert(kKeyframePictureBytes <= kMaxKeyframePictureBytes);
inline constexpr int kMaxHalvings = 2;
inline constexpr double kMaxKeyframePixels = 1e6;  // of a picture that is decoded at all
Bytes encode_picture(ImageView picture, std::size_t max_bytes = kKeyframePictureBytes);

// A JPEG of at most kMaxThumbnailBytes and 160 pixels across; empty where that cannot be had.
Bytes make_thumbnail(ImageView picture);
// The same of a keyframe's picture, which is given back as it is if it is no larger; empty if it cannot be decoded, or
// has more than kMaxKeyframePixels.
Bytes thumbnail_of(ByteSpan jpeg);

}  // namespace relmap::vision
