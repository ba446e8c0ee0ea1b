#include "server/place/spread.h"

#include <algorithm>
#include <bitset>

namespace relmap::place {

double picture_spread(std::span<const AppearanceFeature> features, std::span<const std::uint32_t> chosen,
                      const StereoCamera& camera) {
  constexpr int kColumns = 16, kRows = 12;
  std::bitset<kColumns * kRows> covered;
  for (const std::uint32_t i : chosen) {
    const double u = (double{features[i].u} + 0.5) / camera.width, v = (double{features[i].v} + 0.5) / camera.height;
    const int column = std::clamp(static_cast<int>(u * kColumns), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(v * kRows), 0, kRows - 1);
    covered.set(static_cast<std::size_t>(row * kColumns + column));
  }
  return static_cast<double>(covered.count()) / (kColumns * kRows);
}

}  // namespace relmap::place
