#include "frontend/vision/patch.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#if defined(__SSE4_1__)
#include <smmintrin.h>
#endif

namespace relmap::vision {

namespace {

int rounded_mean_shift(int difference) {
  const int half = kPatchPixels / 2;
  return difference >= 0 ? (difference + half) / kPatchPixels : -((-difference + half) / kPatchPixels);
}

#if defined(__SSE4_1__)
// Loads nine pixels; the other lanes are zero. `Wide`: sixteen bytes may be read.
template <bool Wide>
__m128i load_row(const std::uint8_t* p) {
  if constexpr (!Wide) return _mm_insert_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)), p[8], 8);
  const __m128i lanes = _mm_set_epi8(0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1, -1);
  return _mm_and_si128(lanes, _mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}
int horizontal_sum(__m128i sums) { return _mm_cvtsi128_si32(sums) + _mm_extract_epi32(sums, 2); }

template <bool Wide>
int compare_rows(const std::uint8_t (&rows)[kPatchSide][16], int sum, const std::uint8_t* corner, int stride) {
  const __m128i zero = _mm_setzero_si128();
  __m128i other[kPatchSide];
  __m128i total = zero;
  for (int row = 0; row < kPatchSide; ++row) {
    other[row] = load_row<Wide>(corner + static_cast<std::ptrdiff_t>(row) * stride);
    total = _mm_add_epi32(total, _mm_sad_epu8(other[row], zero));
  }
  const int shift = rounded_mean_shift(horizontal_sum(total) - sum);
  const __m128i lanes = _mm_set_epi8(0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1, -1);
  const __m128i up = _mm_and_si128(lanes, _mm_set1_epi8(static_cast<char>(std::max(shift, 0))));
  const __m128i down = _mm_and_si128(lanes, _mm_set1_epi8(static_cast<char>(std::max(-shift, 0))));
  __m128i sad = zero;
  for (int row = 0; row < kPatchSide; ++row) {
    const __m128i mine = _mm_load_si128(reinterpret_cast<const __m128i*>(rows[row]));
    sad = _mm_add_epi32(sad, _mm_sad_epu8(_mm_subs_epu8(_mm_adds_epu8(mine, up), down), other[row]));
  }
  return horizontal_sum(sad);
}
#endif

}  // namespace

SadPatch::SadPatch(ImageView image, int x, int y) {
  for (int row = 0; row < kPatchSide; ++row)
    std::memcpy(rows_[row], image.row(y - kPatchRadius + row) + x - kPatchRadius, kPatchSide);
  finish();
}

SadPatch::SadPatch(const std::array<std::uint8_t, kPatchPixels>& pixels) {
  for (int row = 0; row < kPatchSide; ++row) std::memcpy(rows_[row], pixels.data() + row * kPatchSide, kPatchSide);
  finish();
}

void SadPatch::finish() {
  sum_ = 0;
  for (const auto& row : rows_)
    for (const std::uint8_t pixel : row) sum_ += pixel;
}

int SadPatch::compare(ImageView image, int x, int y) const {
  const std::uint8_t* corner = image.row(y - kPatchRadius) + x - kPatchRadius;
#if defined(__SSE4_1__)
  // The wide load must not read beyond the row.
  return x - kPatchRadius + 16 <= image.width ? compare_rows<true>(rows_, sum_, corner, image.stride)
                                              : compare_rows<false>(rows_, sum_, corner, image.stride);
#else
  int total = 0;
  for (int row = 0; row < kPatchSide; ++row)
    for (int column = 0; column < kPatchSide; ++column)
      total += corner[static_cast<std::ptrdiff_t>(row) * image.stride + column];
  const int shift = rounded_mean_shift(total - sum_);
  int sad = 0;
  for (int row = 0; row < kPatchSide; ++row)
    for (int column = 0; column < kPatchSide; ++column)
      sad += std::abs(std::clamp(rows_[row][column] + shift, 0, 255) -
                      corner[static_cast<std::ptrdiff_t>(row) * image.stride + column]);
  return sad;
#endif
}

}  // namespace relmap::vision
