// What a simulated camera sends where it is told nothing else: no two frames share a byte's place, by which bytes of
// another frame are found.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace relmap::testing {

// A texture, with the frame's number at byte 64.
void default_frame(std::uint64_t number, std::span<std::uint8_t> bytes);

// The number of one, padding left out; nullopt if a byte of it, from 64 on, is another frame's.
std::optional<std::uint64_t> default_frame_number(std::span<const std::uint8_t> bytes);

}  // namespace relmap::testing
