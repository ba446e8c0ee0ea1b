#include "frontend/vision/patch.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#if defined(__SSE4_1__)
#include <smmintrin.h>
#endif

namespace relmap {

namespace {

int rounded_mean_shift(int difference) {
  const int half = kPatchPixels / 2;
  return difference >= 0 ? (difference + half) / kPatchPixels : -((-difference + half) / kPatchPixels);
}

#if defined(__SSE4_1__)
// Nine pixels, the other lanes zero. `Wide`: sixteen may be read.
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

// 11 x 11 pixels with their top left corner at (left, top), bilinear; they and those to the right of and below them
// must lie in the picture.
void sample_block(ImageView image, float left, float top, std::array<float, 11 * 11>& out) {
  const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
  const float fx = left - static_cast<float>(x0), fy = top - static_cast<float>(y0);
  const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
  for (int row = 0; row < 11; ++row) {
    const std::uint8_t *above = image.row(y0 + row) + x0, *below = image.row(y0 + row + 1) + x0;
    float* to = out.data() + row * 11;
    for (int column = 0; column < 11; ++column)
      to[column] = w00 * above[column] + w01 * above[column + 1] + w10 * below[column] + w11 * below[column + 1];
  }
}

bool block_fits(ImageView image, float left, float top) {
  return left >= 0 && top >= 0 && left + 11 < static_cast<float>(image.width) &&
         top + 11 < static_cast<float>(image.height);
}

struct Hessian {
  float xx, xy, yy;
  float determinant() const { return xx * yy - xy * xy; }
};

// Normal equations of a shift (x, y) with brightness and contrast free: their columns, a one and the template t, are
// projected out of the Jacobian. (A contrast 10 % off would else cost tenths of a pixel.) The residual is orthogonal to
// both already.
struct Sums {
  float xx = 0, xy = 0, yy = 0, x1 = 0, y1 = 0, xt = 0, yt = 0, xr = 0, yr = 0;
  void add(float gx, float gy, float t, float r) {
    xx += gx * gx;
    xy += gx * gy;
    yy += gy * gy;
    x1 += gx;
    y1 += gy;
    xt += gx * t;
    yt += gy * t;
    xr += gx * r;
    yr += gy * r;
  }
  Hessian hessian(float energy) const {
    constexpr float n = kPatchPixels;
    return {xx - x1 * x1 / n - xt * xt / energy, xy - x1 * y1 / n - xt * yt / energy,
            yy - y1 * y1 / n - yt * yt / energy};
  }
};

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
  // Sixteen pixels from there stay in the row.
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

std::optional<Anchor> Anchor::take(ImageView image, float x, float y) {
  const int x0 = static_cast<int>(std::lround(x)), y0 = static_cast<int>(std::lround(y));
  if (x0 < kRadius || y0 < kRadius || x0 >= image.width - kRadius || y0 >= image.height - kRadius) return std::nullopt;
  Anchor anchor;
  anchor.x = x - static_cast<float>(x0);
  anchor.y = y - static_cast<float>(y0);
  for (int row = 0; row < kSide; ++row)
    std::memcpy(anchor.pixels.data() + row * kSide, image.row(y0 - kRadius + row) + x0 - kRadius, kSide);
  return anchor;
}

std::optional<Template> Template::from_anchor(const Anchor& anchor, const Warp& warp) {
  const ImageView block{anchor.pixels.data(), Anchor::kSide, Anchor::kSide, Anchor::kSide};
  Surroundings surroundings;
  for (int row = 0; row < 11; ++row)
    for (int column = 0; column < 11; ++column) {
      const auto dx = static_cast<float>(column - 5), dy = static_cast<float>(row - 5);
      const float x = Anchor::kRadius + anchor.x + warp.a * dx + warp.b * dy;
      const float y = Anchor::kRadius + anchor.y + warp.c * dx + warp.d * dy;
      if (!(x >= 0 && y >= 0 && x < Anchor::kSide - 1 && y < Anchor::kSide - 1)) return std::nullopt;
      surroundings[static_cast<std::size_t>(row * 11 + column)] = sample(block, x, y);
    }
  Template result;
  if (!result.prepare(surroundings)) return std::nullopt;
  return result;
}

std::optional<Template> Template::from_image(ImageView image, float x, float y) {
  const float left = x - 5, top = y - 5;
  if (!block_fits(image, left, top)) return std::nullopt;
  Surroundings surroundings;
  sample_block(image, left, top, surroundings);
  Template result;
  if (!result.prepare(surroundings)) return std::nullopt;
  return result;
}

bool Template::prepare(const Surroundings& surroundings) {
  float sum = 0;
  for (std::size_t row = 0; row < kPatchSide; ++row)
    for (std::size_t column = 0; column < kPatchSide; ++column) {
      const std::size_t from = (row + 1) * 11 + column + 1, to = row * kPatchSide + column;
      pixels_[to] = surroundings[from];
      gx_[to] = 0.5F * (surroundings[from + 1] - surroundings[from - 1]);
      gy_[to] = 0.5F * (surroundings[from + 11] - surroundings[from - 11]);
      sum += pixels_[to];
    }
  mean_ = sum / kPatchPixels;
  energy_ = 0;
  for (float& pixel : pixels_) {
    pixel -= mean_;
    energy_ += pixel * pixel;
  }
  if (!(energy_ > kPatchPixels)) return false;
  Sums own;
  for (std::size_t i = 0; i < kPatchPixels; ++i) own.add(gx_[i], gy_[i], pixels_[i], 0);
  const Hessian h = own.hessian(energy_);
  // The weaker direction must have a gradient of about 1 grey level a pixel, and 1 % of the stronger one's energy.
  const float trace = h.xx + h.yy;
  return h.determinant() > trace * kPatchPixels && h.determinant() > 0.01F * trace * trace;
}

SadPatch Template::sad() const {
  std::array<std::uint8_t, kPatchPixels> pixels;
  for (std::size_t i = 0; i < kPatchPixels; ++i)
    pixels[i] = static_cast<std::uint8_t>(std::clamp(std::lround(pixels_[i] + mean_), 0L, 255L));
  return SadPatch(pixels);
}

std::optional<Template::Alignment> Template::align(ImageView image, float x, float y, float reach) const {
  constexpr int kIterations = 10;
  constexpr float kSettled = 0.01F;
  const float start_x = x, start_y = y;
  Surroundings block;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const float left = x - 5, top = y - 5;
    if (!block_fits(image, left, top)) return std::nullopt;
    sample_block(image, left, top, block);
    float sum = 0, cross = 0, energy = 0;
    for (std::size_t row = 0; row < kPatchSide; ++row)
      for (std::size_t column = 0; column < kPatchSide; ++column) {
        const float value = block[(row + 1) * 11 + column + 1];
        sum += value;
        energy += value * value;
        cross += value * pixels_[row * kPatchSide + column];
      }
    const float mean = sum / kPatchPixels, contrast = cross / energy_;
    if (!(contrast > 0)) return std::nullopt;
    Sums sums;
    float error = 0;
    for (std::size_t row = 0; row < kPatchSide; ++row)
      for (std::size_t column = 0; column < kPatchSide; ++column) {
        const std::size_t from = (row + 1) * 11 + column + 1, to = row * kPatchSide + column;
        const float residual = block[from] - mean - contrast * pixels_[to];
        sums.add(0.5F * (contrast * gx_[to] + 0.5F * (block[from + 1] - block[from - 1])),
                 0.5F * (contrast * gy_[to] + 0.5F * (block[from + 11] - block[from - 11])), pixels_[to], residual);
        error += std::abs(residual);
      }
    const Hessian h = sums.hessian(energy_);
    const float determinant = h.determinant();
    if (!(determinant > 0)) return std::nullopt;
    const float dx = (h.yy * sums.xr - h.xy * sums.yr) / determinant;
    const float dy = (h.xx * sums.yr - h.xy * sums.xr) / determinant;
    x -= dx;
    y -= dy;
    if (!(std::abs(x - start_x) <= reach && std::abs(y - start_y) <= reach)) return std::nullopt;
    if (dx * dx + dy * dy < kSettled * kSettled) {
      const float norm = std::sqrt((energy - sum * mean) * energy_);
      return Alignment{x, y, error / kPatchPixels, norm > 0 ? cross / norm : 0};
    }
  }
  return std::nullopt;
}

}  // namespace relmap
