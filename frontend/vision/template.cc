#include "frontend/vision/template.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace relmap::vision {

namespace {

using Lanes = float __attribute__((vector_size(16)));

Lanes load(const float* p) {
  Lanes lanes;
  std::memcpy(&lanes, p, sizeof lanes);
  return lanes;
}
void store(Lanes lanes, float* p) { std::memcpy(p, &lanes, sizeof lanes); }
Lanes load_bytes(const std::uint8_t* p) {
  std::uint8_t __attribute__((vector_size(4))) bytes;
  std::memcpy(&bytes, p, sizeof bytes);
  return __builtin_convertvector(bytes, Lanes);
}
float sum(Lanes lanes) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }

constexpr Lanes kWhole{1, 1, 1, 1}, kFirst{1, 0, 0, 0};
// The ninth pixel of a row is the first lane of the row's third vector.
constexpr Lanes used(int vector) { return vector < 2 ? kWhole : kFirst; }

struct Hessian {
  float xx, xy, yy;
  float determinant() const { return xx * yy - xy * xy; }
};

// Normal equations of a shift (x, y) with brightness and contrast free: the columns of these, a constant one and the
// template t, are projected out of the Jacobian. (Otherwise a contrast that is 10 % off would cost tenths of a pixel.)
// The residual is orthogonal to both already. Unused lanes are zero in gx, gy and r.
struct Sums {
  Lanes xx{}, xy{}, yy{}, x1{}, y1{}, xt{}, yt{}, xr{}, yr{};
  void add(Lanes gx, Lanes gy, Lanes t, Lanes r) {
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
    const float sx = sum(x1), sy = sum(y1), tx = sum(xt), ty = sum(yt);
    return {sum(xx) - sx * sx / n - tx * tx / energy, sum(xy) - sx * sy / n - tx * ty / energy,
            sum(yy) - sy * sy / n - ty * ty / energy};
  }
};

}  // namespace

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

// Bilinear; block_fits() must hold.
void Template::sample_block(ImageView image, float left, float top, Surroundings& out) {
  const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
  const float fx = left - static_cast<float>(x0), fy = top - static_cast<float>(y0);
  const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
  for (int row = 0; row < kPatchSide + 2; ++row) {
    const std::uint8_t *above = image.row(y0 + row) + x0, *below = image.row(y0 + row + 1) + x0;
    for (int column = 0; column < kRow; column += 4)
      store(w00 * load_bytes(above + column) + w01 * load_bytes(above + column + 1) + w10 * load_bytes(below + column) +
                w11 * load_bytes(below + column + 1),
            out.data() + row * kRow + column);
  }
}

namespace {

bool block_fits(ImageView image, float left, float top) {
  return left >= 0 && top >= 0 && left + 13 <= static_cast<float>(image.width) &&
         top + 12 <= static_cast<float>(image.height);
}

}  // namespace

std::optional<Template> Template::from_anchor(const Anchor& anchor, const Warp& warp) {
  const ImageView block{anchor.pixels.data(), Anchor::kSide, Anchor::kSide, Anchor::kSide};
  constexpr int kSide = kPatchSide + 2, kMiddle = kSide / 2;
  const float x0 = Anchor::kRadius + anchor.x, y0 = Anchor::kRadius + anchor.y;
  // The warp is linear: if its corners are inside, all is.
  for (const int dy : {-kMiddle, kMiddle})
    for (const int dx : {-kMiddle, kMiddle}) {
      const float x = x0 + warp.a * static_cast<float>(dx) + warp.b * static_cast<float>(dy);
      const float y = y0 + warp.c * static_cast<float>(dx) + warp.d * static_cast<float>(dy);
      if (!(x >= 0 && y >= 0 && x < Anchor::kSide - 1 && y < Anchor::kSide - 1)) return std::nullopt;
    }
  Surroundings surroundings{};
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      const auto dx = static_cast<float>(column - kMiddle), dy = static_cast<float>(row - kMiddle);
      surroundings[static_cast<std::size_t>(row * kRow + column)] =
          sample(block, x0 + warp.a * dx + warp.b * dy, y0 + warp.c * dx + warp.d * dy);
    }
  Template result;
  if (!result.prepare(surroundings)) return std::nullopt;
  return result;
}

std::optional<Template> Template::from_image(ImageView image, float x, float y) {
  const float left = x - 5, top = y - 5;
  if (!block_fits(image, left, top)) return std::nullopt;
  Surroundings surroundings{};
  sample_block(image, left, top, surroundings);
  Template result;
  if (!result.prepare(surroundings)) return std::nullopt;
  return result;
}

bool Template::prepare(const Surroundings& surroundings) {
  Lanes total{};
  for (int row = 0; row < kPatchSide; ++row)
    for (int vector = 0; vector < 3; ++vector) {
      const float* from = surroundings.data() + (row + 1) * kRow + 1 + 4 * vector;
      const int to = row * kRow + 4 * vector;
      const Lanes value = used(vector) * load(from);
      total += value;
      store(value, pixels_.data() + to);
      store(used(vector) * (0.5F * (load(from + 1) - load(from - 1))), gx_.data() + to);
      store(used(vector) * (0.5F * (load(from + kRow) - load(from - kRow))), gy_.data() + to);
    }
  mean_ = sum(total) / kPatchPixels;
  Lanes energy{};
  for (int row = 0; row < kPatchSide; ++row)
    for (int vector = 0; vector < 3; ++vector) {
      float* pixels = pixels_.data() + row * kRow + 4 * vector;
      const Lanes value = used(vector) * (load(pixels) - mean_);
      energy += value * value;
      store(value, pixels);
    }
  energy_ = sum(energy);
  if (!(energy_ > kPatchPixels)) return false;
  Sums own;
  for (std::size_t i = 0; i < pixels_.size(); i += 4) own.add(load(&gx_[i]), load(&gy_[i]), load(&pixels_[i]), Lanes{});
  const Hessian h = own.hessian(energy_);
  // The weaker direction must have a gradient of about 1 grey level a pixel, and 1 % of the stronger one's energy.
  const float trace = h.xx + h.yy;
  return h.determinant() > trace * kPatchPixels && h.determinant() > 0.01F * trace * trace;
}

SadPatch Template::sad() const {
  std::array<std::uint8_t, kPatchPixels> pixels;
  for (std::size_t row = 0; row < kPatchSide; ++row)
    for (std::size_t column = 0; column < kPatchSide; ++column)
      pixels[row * kPatchSide + column] =
          static_cast<std::uint8_t>(std::clamp(pixels_[row * kRow + column] + mean_ + 0.5F, 0.0F, 255.0F));
  return SadPatch(pixels);
}

std::optional<Template::Alignment> Template::align(ImageView image, float x, float y, float reach) const {
  constexpr int kIterations = 10;
  constexpr float kConverged = 0.02F;  // pixels; the next step would be a small part of that
  const float start_x = x, start_y = y;
  Surroundings block{};
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const float left = x - 5, top = y - 5;
    if (!block_fits(image, left, top)) return std::nullopt;
    sample_block(image, left, top, block);
    Lanes total{}, cross_lanes{}, squares{};
    for (int row = 0; row < kPatchSide; ++row)
      for (int vector = 0; vector < 3; ++vector) {
        const Lanes value = used(vector) * load(block.data() + (row + 1) * kRow + 1 + 4 * vector);
        total += value;
        squares += value * value;
        cross_lanes += value * load(pixels_.data() + row * kRow + 4 * vector);
      }
    const float mean = sum(total) / kPatchPixels, cross = sum(cross_lanes), contrast = cross / energy_;
    if (!(contrast > 0)) return std::nullopt;
    Sums sums;
    Lanes error{};
    for (int row = 0; row < kPatchSide; ++row)
      for (int vector = 0; vector < 3; ++vector) {
        const float* from = block.data() + (row + 1) * kRow + 1 + 4 * vector;
        const int to = row * kRow + 4 * vector;
        const Lanes pixels = load(pixels_.data() + to);
        const Lanes residual = used(vector) * (load(from) - mean - contrast * pixels);
        sums.add(
            used(vector) * (0.5F * contrast * load(gx_.data() + to) + 0.25F * (load(from + 1) - load(from - 1))),
            used(vector) * (0.5F * contrast * load(gy_.data() + to) + 0.25F * (load(from + kRow) - load(from - kRow))),
            pixels, residual);
        error += residual < 0 ? -residual : residual;
      }
    const Hessian h = sums.hessian(energy_);
    const float determinant = h.determinant(), xr = sum(sums.xr), yr = sum(sums.yr);
    if (!(determinant > 0)) return std::nullopt;
    const float dx = (h.yy * xr - h.xy * yr) / determinant;
    const float dy = (h.xx * yr - h.xy * xr) / determinant;
    x -= dx;
    y -= dy;
    if (!(std::abs(x - start_x) <= reach && std::abs(y - start_y) <= reach)) return std::nullopt;
    if (dx * dx + dy * dy < kConverged * kConverged) {
      const float norm = std::sqrt((sum(squares) - kPatchPixels * mean * mean) * energy_);
      return Alignment{x, y, sum(error) / kPatchPixels, norm > 0 ? cross / norm : 0};
    }
  }
  return std::nullopt;
}

}  // namespace relmap::vision
