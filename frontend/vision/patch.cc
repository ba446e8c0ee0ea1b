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
// Nine pixels, the other lanes zero; never reads past them.
__m128i load_row(const std::uint8_t* p) {
  return _mm_insert_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)), p[8], 8);
}
int horizontal_sum(__m128i sums) { return _mm_cvtsi128_si32(sums) + _mm_extract_epi32(sums, 2); }
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
  const __m128i zero = _mm_setzero_si128();
  __m128i other[kPatchSide];
  __m128i total = zero;
  for (int row = 0; row < kPatchSide; ++row) {
    other[row] = load_row(corner + static_cast<std::ptrdiff_t>(row) * image.stride);
    total = _mm_add_epi32(total, _mm_sad_epu8(other[row], zero));
  }
  const int shift = rounded_mean_shift(horizontal_sum(total) - sum_);
  const __m128i lanes = _mm_set_epi8(0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1, -1, -1, -1, -1, -1);
  const __m128i up = _mm_and_si128(lanes, _mm_set1_epi8(static_cast<char>(std::max(shift, 0))));
  const __m128i down = _mm_and_si128(lanes, _mm_set1_epi8(static_cast<char>(std::max(-shift, 0))));
  __m128i sad = zero;
  for (int row = 0; row < kPatchSide; ++row) {
    const __m128i mine = _mm_load_si128(reinterpret_cast<const __m128i*>(rows_[row]));
    sad = _mm_add_epi32(sad, _mm_sad_epu8(_mm_subs_epu8(_mm_adds_epu8(mine, up), down), other[row]));
  }
  return horizontal_sum(sad);
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
  std::array<float, 11 * 11> surroundings;
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
  if (!(left >= 0 && top >= 0 && x + 6 < static_cast<float>(image.width) && y + 6 < static_cast<float>(image.height)))
    return std::nullopt;
  std::array<float, 11 * 11> surroundings;
  for (int row = 0; row < 11; ++row)
    for (int column = 0; column < 11; ++column)
      surroundings[static_cast<std::size_t>(row * 11 + column)] =
          sample(image, left + static_cast<float>(column), top + static_cast<float>(row));
  Template result;
  if (!result.prepare(surroundings)) return std::nullopt;
  return result;
}

bool Template::prepare(const std::array<float, 11 * 11>& surroundings) {
  float sum = 0, sum_gx = 0, sum_gy = 0;
  for (std::size_t row = 0; row < kPatchSide; ++row)
    for (std::size_t column = 0; column < kPatchSide; ++column) {
      const std::size_t from = (row + 1) * 11 + column + 1, to = row * kPatchSide + column;
      pixels_[to] = surroundings[from];
      gx_[to] = 0.5F * (surroundings[from + 1] - surroundings[from - 1]);
      gy_[to] = 0.5F * (surroundings[from + 11] - surroundings[from - 11]);
      sum += pixels_[to];
      sum_gx += gx_[to];
      sum_gy += gy_[to];
    }
  mean_ = sum / kPatchPixels;
  // A free mean takes the gradients' own means out of them, a free contrast their share in the template itself: a step
  // then answers to neither (a contrast 10 % off would cost tenths of a pixel).
  energy_ = 0;
  float along_x = 0, along_y = 0;
  for (std::size_t i = 0; i < kPatchPixels; ++i) {
    pixels_[i] -= mean_;
    gx_[i] -= sum_gx / kPatchPixels;
    gy_[i] -= sum_gy / kPatchPixels;
    energy_ += pixels_[i] * pixels_[i];
    along_x += gx_[i] * pixels_[i];
    along_y += gy_[i] * pixels_[i];
  }
  if (!(energy_ > kPatchPixels)) return false;
  float hxx = 0, hxy = 0, hyy = 0;
  for (std::size_t i = 0; i < kPatchPixels; ++i) {
    gx_[i] -= along_x / energy_ * pixels_[i];
    gy_[i] -= along_y / energy_ * pixels_[i];
    hxx += gx_[i] * gx_[i];
    hxy += gx_[i] * gy_[i];
    hyy += gy_[i] * gy_[i];
  }
  const float determinant = hxx * hyy - hxy * hxy;
  const float trace = hxx + hyy;
  // The weaker direction must have a gradient of about 1 grey level a pixel, and 1 % of the stronger one's energy.
  if (!(determinant > trace * kPatchPixels) || !(determinant > 0.01F * trace * trace)) return false;
  ixx_ = hyy / determinant;
  ixy_ = -hxy / determinant;
  iyy_ = hxx / determinant;
  return true;
}

SadPatch Template::sad() const {
  std::array<std::uint8_t, kPatchPixels> pixels;
  for (std::size_t i = 0; i < kPatchPixels; ++i)
    pixels[i] = static_cast<std::uint8_t>(std::clamp(std::lround(pixels_[i] + mean_), 0L, 255L));
  return SadPatch(pixels);
}

std::optional<Template::Alignment> Template::align(ImageView image, float x, float y, float reach) const {
  constexpr int kIterations = 12;
  constexpr float kSettled = 0.01F;
  const float start_x = x, start_y = y;
  std::array<float, kPatchPixels> current;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const float left = x - kPatchRadius, top = y - kPatchRadius;
    if (!(left >= 0 && top >= 0 && x + kPatchRadius + 1 < static_cast<float>(image.width) &&
          y + kPatchRadius + 1 < static_cast<float>(image.height)))
      return std::nullopt;
    const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
    const float fx = left - static_cast<float>(x0), fy = top - static_cast<float>(y0);
    const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
    float sum = 0;
    for (int row = 0; row < kPatchSide; ++row) {
      const std::uint8_t *above = image.row(y0 + row) + x0, *below = image.row(y0 + row + 1) + x0;
      float* out = current.data() + row * kPatchSide;
      for (int column = 0; column < kPatchSide; ++column) {
        out[column] = w00 * above[column] + w01 * above[column + 1] + w10 * below[column] + w11 * below[column + 1];
        sum += out[column];
      }
    }
    const float mean = sum / kPatchPixels;
    float bx = 0, by = 0;
    for (std::size_t i = 0; i < kPatchPixels; ++i) {
      const float difference = current[i] - mean - pixels_[i];
      bx += gx_[i] * difference;
      by += gy_[i] * difference;
    }
    const float dx = ixx_ * bx + ixy_ * by, dy = ixy_ * bx + iyy_ * by;
    x -= dx;
    y -= dy;
    if (!(std::abs(x - start_x) <= reach && std::abs(y - start_y) <= reach)) return std::nullopt;
    if (dx * dx + dy * dy < kSettled * kSettled) {
      float error = 0, cross = 0, energy = 0;
      for (std::size_t i = 0; i < kPatchPixels; ++i) {
        const float value = current[i] - mean;
        error += std::abs(value - pixels_[i]);
        cross += value * pixels_[i];
        energy += value * value;
      }
      const float norm = std::sqrt(energy * energy_);
      return Alignment{x, y, error / kPatchPixels, norm > 0 ? cross / norm : 0};
    }
  }
  return std::nullopt;
}

}  // namespace relmap
