// What Point Grey's cameras write into the first bytes of a frame, in the place of pixels.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "frontend/capture/iidc/register_file.h"
#include "proto/base/status.h"

namespace relmap::iidc {

struct EmbeddedInfo {
  std::uint32_t cycle = 0;    // when the exposure began, by the camera's cycle timer (cycle_clock.h)
  std::uint32_t counter = 0;  // of frames, whether they came or not
};

// Asks the camera for a time stamp and a counter (FRAME_INFO; Digital Camera Register Reference). False: it has none,
// or is not of that maker.
Result<bool> embed_info(const RegisterFile& registers);

// Of a frame of a camera that embeds both. Nothing: no stamp can be so, and these are not the first bytes of a frame.
std::optional<EmbeddedInfo> embedded_info(std::span<const std::uint8_t> frame);

// Behind the last counter, and within what can have been lost.
bool follows(std::uint32_t counter, std::uint32_t last);

}  // namespace relmap::iidc
