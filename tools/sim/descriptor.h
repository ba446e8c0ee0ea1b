// Made-up descriptors with the statistics of SIFT's: half of the entries zero, L2 norm about 512.
#pragma once

#include <array>
#include <cstdint>

#include "tools/sim/random.h"

namespace relmap::sim {

using Descriptor = std::array<std::uint8_t, 128>;

Descriptor make_descriptor(Stream& random);
// Changes each entry that is not zero by at most `max_change`, within 0..255.
void disturb_descriptor(Descriptor& descriptor, std::uint32_t max_change, Stream& random);

}  // namespace relmap::sim
