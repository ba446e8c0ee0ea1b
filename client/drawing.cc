#include "client/drawing.h"

#include <algorithm>
#include <cmath>

namespace relmap::client {

Colour mix(Colour from, Colour to, double t) {
  const auto channel = [t](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(a + t * (b - a)), 0L, 255L));
  };
  return {channel(from.red, to.red), channel(from.green, to.green), channel(from.blue, to.blue)};
}

void Drawing::rectangle(const Vector2& corner, const Vector2& size, Colour fill, double opacity) {
  polygon({corner, corner + Vector2(size.x(), 0), corner + size, corner + Vector2(0, size.y())}, fill, opacity);
}

}  // namespace relmap::client
