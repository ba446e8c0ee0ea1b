// Pictures encoded small enough for transport: those of keyframes, in which features are measured, and thumbnails for
// people to look at.
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/bytes.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::vision {

inline constexpr std::size_t kMaxThumbnailBytes = 4096;
inline constexpr int kThumbnailWidth = 160;

// Returns a JPEG of at most `max_bytes`, of quality 60 to 30. The picture is halved, at most twice, while it does not
// fit or has more than half a megapixel. Empty if it does not fit then.
inline constexpr std::size_t kKeyframePictureBytes = 32 * 1024;
static_assert(kKeyframePictureBytes <= kMaxKeyframePictureBytes);
inline constexpr int kMaxHalvings = 2;
inline constexpr double kMaxKeyframePixels = 1e6;  // larger pictures are not decoded
Bytes encode_picture(ImageView picture, std::size_t max_bytes = kKeyframePictureBytes);

// Returns a JPEG of at most kMaxThumbnailBytes, at most kThumbnailWidth pixels wide; empty if it does not fit.
Bytes make_thumbnail(ImageView picture);
// The thumbnail of a keyframe's picture; a picture of at most kMaxThumbnailBytes is returned unchanged. Empty if it
// cannot be decoded or has more than kMaxKeyframePixels.
Bytes thumbnail_of(ByteSpan jpeg);

}  // namespace relmap::vision
