#include "frontend/vision/exposure.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relmap {

namespace {
constexpr double kMean = 112, kDeviation = 48;
constexpr double kMostGain = 4;
}  // namespace

Exposure measure_exposure(ImageView picture) {
  std::uint64_t sum = 0, squares = 0, count = 0;
  for (int y = 0; y < picture.height; y += 2) {
    const std::uint8_t* row = picture.row(y);
    std::uint32_t row_sum = 0, row_squares = 0;
    for (int x = 0; x < picture.width; x += 2) {
      row_sum += row[x];
      row_squares += static_cast<std::uint32_t>(row[x]) * row[x];
    }
    sum += row_sum;
    squares += row_squares;
    count += static_cast<std::uint64_t>((picture.width + 1) / 2);
  }
  if (count == 0) return {};
  const double n = static_cast<double>(count), mean = static_cast<double>(sum) / n;
  return {mean, std::sqrt(std::max(0.0, static_cast<double>(squares) / n - mean * mean))};
}

Image standardise(ImageView picture, const Exposure& exposure) {
  const double gain = std::clamp(kDeviation / std::max(exposure.deviation, 1e-3), 1 / kMostGain, kMostGain);
  std::array<std::uint8_t, 256> table;
  for (int i = 0; i < 256; ++i)
    table[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(std::clamp(std::lround((i - exposure.mean) * gain + kMean), 0L, 255L));
  Image image(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* row = picture.row(y);
    std::uint8_t* out = image.row(y);
    for (int x = 0; x < picture.width; ++x) out[x] = table[row[x]];
  }
  return image;
}

}  // namespace relmap
