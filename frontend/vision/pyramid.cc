#include "frontend/vision/pyramid.h"

#include <algorithm>
#include <utility>

#if defined(__SSE4_1__)
#include <smmintrin.h>
#endif

namespace relmap::vision {

namespace {

constexpr int kMinLevelSide = 32;

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

Pyramid::Pyramid(Image picture, int max_levels) {
  images_.reserve(static_cast<std::size_t>(std::max(1, max_levels)));
  images_.push_back(std::move(picture));
  while (levels() < max_levels && std::min(images_.back().width(), images_.back().height()) / 2 >= kMinLevelSide)
    images_.push_back(halve(images_.back()));
}

}  // namespace relmap::vision
