// How a stereo camera puts two eyes into one raw frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "frontend/vision/image.h"
#include "proto/base/status.h"

namespace relmap::capture {

// The colours of the upper left two by two pixels, row by row (the order of IIDC's COLOR_FILTER_ID); none: grey.
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

// The two eyes, grey, into pictures whose memory is used again where it is of that size; left and right are two. Under
// a colour filter a pixel becomes the mean of the nine around it by the weights [1 2 1] down and across, mirrored at
// the border: 1/4 red, 1/2 green, 1/4 blue wherever it stands in the pattern, so that what is flat stays flat,
// symmetric, so that nothing moves, and as sharp as a pattern of two by two allows. BAD_SIZE: fewer bytes than
// layout.bytes(), a size that is none, or under a filter a side of one pixel; the pictures are as they were. More bytes
// are padding of the last packet, passed over. Thread-safe.
Status unpack(const StereoLayout& layout, std::span<const std::uint8_t> raw, vision::Image& left, vision::Image& right);

namespace detail {
// The same, pixel by pixel, as on machines without the instructions.
Status unpack_plainly(const StereoLayout& layout, std::span<const std::uint8_t> raw, vision::Image& left,
                      vision::Image& right);
}  // namespace detail

}  // namespace relmap::capture
