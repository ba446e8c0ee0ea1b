// Made-up descriptors with the statistics of SIFT's: half of the entries zero, L2 norm about 512.
#pragma once

#include <array>
#include <cstdint>

#include "tools/sim/random_stream.h"

namespace relmap::sim {

using Descriptor = std::array<std::uint8_t, 128>;

Descriptor make_descriptor(Stream& random);
// Moves each entry that is not zero by at most `largest`, within 0..255.
void disturb_descriptor(Descriptor& descriptor, std::uint32_t largest, Stream& random);

}  // namespace relmap::sim
