// Reads what Point Grey's cameras write into the first bytes of a frame, in place of pixels.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "frontend/capture/iidc/register_file.h"
#include "proto/base/status.h"

namespace relmap::iidc {

struct EmbeddedInfo {
  std::uint32_t cycle = 0;    // start of the exposure by the camera's cycle timer (cycle_clock.h)
  std::uint32_t counter = 0;  // counts all frames, including those that did not arrive
};

// Makes the camera embed a time stamp and a counter (FRAME_INFO; Digital Camera Register Reference). Returns false if
// it cannot, or is not of that maker.
Result<bool> embed_info(const RegisterFile& registers);

// The information in a frame of a camera that embeds both. Nothing if the stamp is invalid, so that these are not the
// first bytes of a frame.
std::optional<EmbeddedInfo> embedded_info(std::span<const std::uint8_t> frame);

// Whether `counter` may follow `last`: it is later, by no more frames than can have been lost.
bool follows(std::uint32_t counter, std::uint32_t last);

}  // namespace relmap::iidc
