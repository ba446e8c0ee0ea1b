// How a stereo camera puts two eyes into one raw frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "frontend/vision/image.h"
#include "proto/status.h"

namespace relmap {

// The colours of the upper left two by two pixels, row by row (IIDC 1.32, 4.11; libdc1394's order); none: grey.
enum class ColourFilter : std::uint8_t { kNone, kRGGB, kGBRG, kGRBG, kBGGR };

enum class FirstByte : std::uint8_t { kLeft, kRight };

// A word of 16 bits for each pixel, one eye in each of its bytes, row by row from the top (Bumblebee2: Format7 mode 3).
struct StereoLayout {
  int width = 0, height = 0;                 // pixels, of one eye
  FirstByte first_byte = FirstByte::kRight;  // whose byte comes first; a Bumblebee2 sends the right eye's
  ColourFilter filter = ColourFilter::kNone;

  std::size_t bytes() const { return 2 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  bool operator==(const StereoLayout&) const = default;
};

// The two eyes, grey, into pictures whose memory is used again where it is of that size. Under a colour filter a pixel
// becomes the brightness of the four around it: a smooth, shift-free grey (docs/cameras.md). BAD_SIZE: fewer bytes than
// layout.bytes(), or a size that is none (more follow: padding of the last packet, passed over).
Status unpack(const StereoLayout& layout, std::span<const std::uint8_t> raw, Image& left, Image& right);

}  // namespace relmap
