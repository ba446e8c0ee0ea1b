#include "tools/sim/canvas.h"

#include <algorithm>
#include <cmath>

namespace relmap::sim {

Canvas::Canvas(double width_m, double height_m, double texels_per_metre, double value)
    : scale_(texels_per_metre),
      width_(std::max(2, static_cast<int>(std::ceil(width_m * texels_per_metre)))),
      height_(std::max(2, static_cast<int>(std::ceil(height_m * texels_per_metre)))),
      pixels_(static_cast<std::size_t>(width_) * height_, static_cast<float>(value)) {}

Canvas::Span Canvas::span(double low, double high, int size) const {
  const auto bound = [&](double metres) {
    return static_cast<int>(std::clamp(std::ceil(metres * scale_ - 0.5), 0.0, static_cast<double>(size)));
  };
  return {bound(low), bound(high)};
}

void Canvas::fill_rect(double x0, double y0, double x1, double y1, double value) {
  const Span xs = span(x0, x1, width_), ys = span(y0, y1, height_);
  for (int y = ys.begin; y < ys.end; ++y)
    for (int x = xs.begin; x < xs.end; ++x) pixel(x, y) = static_cast<float>(value);
}

void Canvas::frame_rect(double x0, double y0, double x1, double y1, double thickness, double value) {
  fill_rect(x0, y0, x1, y0 + thickness, value);
  fill_rect(x0, y1 - thickness, x1, y1, value);
  fill_rect(x0, y0, x0 + thickness, y1, value);
  fill_rect(x1 - thickness, y0, x1, y1, value);
}

void Canvas::fill_ellipse(double x, double y, double radius_x, double radius_y, double value) {
  const Span ys = span(y - radius_y, y + radius_y, height_);
  for (int row = ys.begin; row < ys.end; ++row) {
    const double dy = ((row + 0.5) / scale_ - y) / radius_y;
    const double half = radius_x * std::sqrt(std::max(0.0, 1 - dy * dy));
    const Span xs = span(x - half, x + half, width_);
    for (int column = xs.begin; column < xs.end; ++column) pixel(column, row) = static_cast<float>(value);
  }
}

void Canvas::fill_polygon(const std::vector<Vector2>& convex, double value) {
  double top = convex[0].y(), bottom = top;
  for (const Vector2& p : convex) {
    top = std::min(top, p.y());
    bottom = std::max(bottom, p.y());
  }
  const Span ys = span(top, bottom, height_);
  for (int row = ys.begin; row < ys.end; ++row) {
    const double y = (row + 0.5) / scale_;
    double left = 1e30, right = -1e30;
    for (std::size_t k = 0; k < convex.size(); ++k) {
      const Vector2& a = convex[k];
      const Vector2& b = convex[(k + 1) % convex.size()];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      const double x = a.x() + (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y());
      left = std::min(left, x);
      right = std::max(right, x);
    }
    const Span xs = span(left, right, width_);
    for (int column = xs.begin; column < xs.end; ++column) pixel(column, row) = static_cast<float>(value);
  }
}

void Canvas::line(const Vector2& from, const Vector2& to, double thickness, double value) {
  const Vector2 along = to - from;
  if (along.norm() < 1e-9) return;
  const Vector2 side = Vector2(-along.y(), along.x()).normalized() * (thickness / 2);
  fill_polygon({from + side, to + side, to - side, from - side}, value);
}

void Canvas::shade_rect(double x0, double y0, double x1, double y1, double top_factor, double bottom_factor) {
  const Span xs = span(x0, x1, width_), ys = span(y0, y1, height_);
  for (int y = ys.begin; y < ys.end; ++y) {
    const double t = std::clamp(((y + 0.5) / scale_ - y0) / (y1 - y0), 0.0, 1.0);
    const float factor = static_cast<float>(top_factor + t * (bottom_factor - top_factor));
    for (int x = xs.begin; x < xs.end; ++x) pixel(x, y) *= factor;
  }
}

void Canvas::roughen(double x0, double y0, double x1, double y1, double grain_m, double amplitude, Random& random) {
  const Span xs = span(x0, x1, width_), ys = span(y0, y1, height_);
  if (xs.begin >= xs.end || ys.begin >= ys.end) return;
  const float cells_per_texel = static_cast<float>(1 / std::max(1.0, grain_m * scale_));
  const int columns = static_cast<int>(static_cast<float>(xs.end - xs.begin) * cells_per_texel) + 2;
  const int rows = static_cast<int>(static_cast<float>(ys.end - ys.begin) * cells_per_texel) + 2;
  std::vector<float> lattice(static_cast<std::size_t>(columns) * rows);
  for (float& value : lattice) value = static_cast<float>(1 + amplitude * random.uniform(-1, 1));
  for (int y = ys.begin; y < ys.end; ++y) {
    const float gy = static_cast<float>(y - ys.begin) * cells_per_texel;
    const int cy = static_cast<int>(gy);
    const float fy = gy - static_cast<float>(cy);
    const float* upper = lattice.data() + static_cast<std::ptrdiff_t>(cy) * columns;
    const float* lower = upper + columns;
    for (int x = xs.begin; x < xs.end; ++x) {
      const float gx = static_cast<float>(x - xs.begin) * cells_per_texel;
      const int cx = static_cast<int>(gx);
      const float fx = gx - static_cast<float>(cx);
      const float a = upper[cx] + fx * (upper[cx + 1] - upper[cx]);
      const float b = lower[cx] + fx * (lower[cx + 1] - lower[cx]);
      pixel(x, y) *= a + fy * (b - a);
    }
  }
}

}  // namespace relmap::sim
