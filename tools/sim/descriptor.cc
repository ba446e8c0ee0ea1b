#include "tools/sim/descriptor.h"

#include <algorithm>
#include <cmath>

namespace relmap::sim {

Descriptor make_descriptor(Stream& random) {
  std::array<double, 128> entries{};
  double squares = 0;
  for (double& entry : entries) {
    const double u = 2 * random.uniform() - 1;
    entry = u > 0 ? u * u : 0;
    squares += entry * entry;
  }
  Descriptor descriptor{};
  const double scale = 512 / std::sqrt(squares);
  for (std::size_t k = 0; k < entries.size(); ++k)
    descriptor[k] = static_cast<std::uint8_t>(std::min(255.0, std::round(scale * entries[k])));
  return descriptor;
}

void disturb_descriptor(Descriptor& descriptor, std::uint32_t max_change, Stream& random) {
  const int width = 2 * static_cast<int>(max_change) + 1;
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < descriptor.size(); ++k) {
    if (k % 4 == 0) bits = random.bits();
    const int change = static_cast<int>(((bits & 0xffff) * static_cast<std::uint64_t>(width)) >> 16) - width / 2;
    bits >>= 16;
    if (descriptor[k] != 0) descriptor[k] = static_cast<std::uint8_t>(std::clamp(descriptor[k] + change, 0, 255));
  }
}

}  // namespace relmap::sim
