#include "frontend/vision/exposure.h"

#include <algorithm>
#include <cmath>

namespace relmap::vision {

namespace {
constexpr double kMean = 112, kDeviation = 48;
constexpr double kMaxGain = 4;
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
  const double gain = std::clamp(kDeviation / std::max(exposure.deviation, 1e-3), 1 / kMaxGain, kMaxGain);
  // gain * x + shift in 16-bit fixed point, so that compilers vectorise it: x in units of 1/64, the gain in 1/4096,
  // their product in 1/4.
  const auto factor = static_cast<std::uint16_t>(std::lround(gain * 4096));
  const auto shift = static_cast<std::int16_t>(std::lround(4 * (kMean - exposure.mean * gain)) + 2);
  Image image(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* row = picture.row(y);
    std::uint8_t* out = image.row(y);
    for (int x = 0; x < picture.width; ++x) {
      const auto fine = static_cast<std::uint16_t>(row[x] << 6);
      const auto product = static_cast<std::uint16_t>((std::uint32_t{fine} * factor) >> 16);
      const int value = static_cast<std::int16_t>(static_cast<std::int16_t>(product) + shift) >> 2;
      out[x] = static_cast<std::uint8_t>(std::clamp(value, 0, 255));
    }
  }
  return image;
}

}  // namespace relmap::vision
