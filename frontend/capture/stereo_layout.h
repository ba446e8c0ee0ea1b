// Describes how a stereo camera packs two eyes into one raw frame, and unpacks them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "frontend/vision/image.h"
#include "proto/base/status.h"

namespace relmap::capture {

// The colours of the upper left 2 x 2 pixels, row by row, in the order of IIDC's COLOR_FILTER_ID; kNone for grey.
enum class ColourFilter : std::uint8_t { kNone, kRGGB, kGBRG, kGRBG, kBGGR };

enum class FirstByte : std::uint8_t { kLeft, kRight };

// A frame has a 16-bit word for each pixel, with one eye in each byte, row by row from the top (Bumblebee2: Format7
// mode 3).
struct StereoLayout {
  int width = 0, height = 0;                 // pixels of one eye
  FirstByte first_byte = FirstByte::kRight;  // the eye of the first byte; a Bumblebee2 sends the right one first
  ColourFilter filter = ColourFilter::kNone;

  std::size_t bytes() const { return 2 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  bool operator==(const StereoLayout&) const = default;
};

// Unpacks the two eyes as grey pictures into `left` and `right`, two distinct images whose memory is reused if it has
// the right size. Under a colour filter, a pixel becomes the mean of its 3 x 3 neighbourhood with the weights [1 2 1]
// down and across, mirrored at the border. That gives 1/4 red, 1/2 green and 1/4 blue at each position of the pattern,
// so flat areas stay flat; it is symmetric, so nothing shifts; and it is as sharp as a 2 x 2 pattern allows.
//
// Bytes beyond layout.bytes() are padding of the last packet and ignored. BAD_SIZE if there are fewer bytes, if the
// layout has no size, or if a side is one pixel under a filter; the pictures are then unchanged. Thread-safe.
Status unpack(const StereoLayout& layout, std::span<const std::uint8_t> raw, vision::Image& left, vision::Image& right);

namespace detail {
// The same, pixel by pixel, for machines without vector instructions.
Status unpack_plainly(const StereoLayout& layout, std::span<const std::uint8_t> raw, vision::Image& left,
                      vision::Image& right);
}  // namespace detail

}  // namespace relmap::capture
