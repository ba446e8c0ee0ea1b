#include "frontend/vision/pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>

#if defined(__SSE4_1__)
#include <smmintrin.h>
#endif

namespace relmap {

namespace {

constexpr int kSmallestSide = 32;

Image copy(ImageView picture) {
  Image image(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) std::copy_n(picture.row(y), picture.width, image.row(y));
  return image;
}

struct Exposure {
  double mean = 0, deviation = 0;
};

Exposure exposure(ImageView picture) {
  std::uint64_t sum = 0, squares = 0, count = 0;
  for (int y = 0; y < picture.height; y += 2) {
    const std::uint8_t* row = picture.row(y);
    for (int x = 0; x < picture.width; x += 2) {
      sum += row[x];
      squares += static_cast<std::uint64_t>(row[x]) * row[x];
      ++count;
    }
  }
  if (count == 0) return {};
  const double n = static_cast<double>(count), mean = static_cast<double>(sum) / n;
  return {mean, std::sqrt(std::max(0.0, static_cast<double>(squares) / n - mean * mean))};
}

#if defined(__SSE4_1__)
// Eight pixels out of sixteen of two rows.
__m128i halve_rows(const std::uint8_t* above, const std::uint8_t* below) {
  const __m128i ones = _mm_set1_epi8(1);
  const __m128i a = _mm_maddubs_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(above)), ones);
  const __m128i b = _mm_maddubs_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(below)), ones);
  return _mm_srli_epi16(_mm_add_epi16(_mm_add_epi16(a, b), _mm_set1_epi16(2)), 2);
}
#endif

}  // namespace

Image halve(ImageView image) {
  Image half(image.width / 2, image.height / 2);
  for (int y = 0; y < half.height(); ++y) {
    const std::uint8_t* above = image.row(2 * y);
    const std::uint8_t* below = image.row(2 * y + 1);
    std::uint8_t* out = half.row(y);
    int x = 0;
#if defined(__SSE4_1__)
    for (; x + 16 <= half.width(); x += 16)
      _mm_storeu_si128(reinterpret_cast<__m128i*>(out + x),
                       _mm_packus_epi16(halve_rows(above + 2 * x, below + 2 * x),
                                        halve_rows(above + 2 * x + 16, below + 2 * x + 16)));
#endif
    for (; x < half.width(); ++x)
      out[x] = static_cast<std::uint8_t>((above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1] + 2) >> 2);
  }
  return half;
}

Pyramid::Pyramid(ImageView picture, int max_levels) {
  images_.reserve(static_cast<std::size_t>(std::max(1, max_levels)));
  images_.push_back(copy(picture));
  while (levels() < max_levels && std::min(images_.back().width(), images_.back().height()) / 2 >= kSmallestSide)
    images_.push_back(halve(images_.back()));
}

Image equalise(ImageView picture, ImageView reference) {
  const Exposure from = exposure(picture), to = exposure(reference);
  const double gain = from.deviation > 1 ? std::clamp(to.deviation / from.deviation, 0.5, 2.0) : 1;
  std::array<std::uint8_t, 256> table;
  for (int i = 0; i < 256; ++i)
    table[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(std::clamp(std::lround((i - from.mean) * gain + to.mean), 0L, 255L));
  Image image(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* row = picture.row(y);
    std::uint8_t* out = image.row(y);
    for (int x = 0; x < picture.width; ++x) out[x] = table[row[x]];
  }
  return image;
}

}  // namespace relmap
