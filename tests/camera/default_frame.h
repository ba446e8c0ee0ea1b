// The default content of a simulated camera's frames. Each byte depends on the number of its frame, so that bytes of
// another frame are recognised.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace relmap::testing {

// Fills `bytes` with a texture; the number of the frame is at byte 64.
void default_frame(std::uint64_t number, std::span<std::uint8_t> bytes);

// The number of a default frame without its padding; nullopt if a byte from 64 on belongs to another frame.
std::optional<std::uint64_t> default_frame_number(std::span<const std::uint8_t> bytes);

}  // namespace relmap::testing
