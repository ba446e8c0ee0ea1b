#include "frontend/vision/lens.h"

#include <cmath>

namespace relmap {

namespace {

double radial_factor(const Lens& lens, double r2) { return 1 + r2 * (lens.k1 + r2 * lens.k2); }

}  // namespace

Vector2 Lens::project(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  return f * radial_factor(*this, x.squaredNorm()) * x + Vector2(cx, cy);
}

Lens::PointJacobian Lens::jacobian(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  const double r2 = x.squaredNorm();
  PointJacobian normalised;  // dx/dp
  normalised << 1, 0, -x.x(), 0, 1, -x.y();
  normalised /= p.z();
  const Eigen::Matrix2d distorted =
      radial_factor(*this, r2) * Eigen::Matrix2d::Identity() + 2 * (k1 + 2 * k2 * r2) * x * x.transpose();  // d(g x)/dx
  return f * distorted * normalised;
}

Lens::LensJacobian Lens::lens_jacobian(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  const double r2 = x.squaredNorm();
  LensJacobian J;
  J << f * radial_factor(*this, r2) * x, f * r2 * x, f * r2 * r2 * x, Vector2(1, 0), Vector2(0, 1);
  return J;
}

std::optional<Vector2> Lens::undistort(const Vector2& pixel) const {
  constexpr int kMostIterations = 50;
  const Vector2 distorted = (pixel - Vector2(cx, cy)) / f;
  const double target = distorted.norm();
  double r = target;  // Newton's: g(r) r = target
  for (int i = 0; i < kMostIterations; ++i) {
    const double gradient = slope(r * r);
    if (!(gradient > kLeastSlope)) return std::nullopt;
    const double step = (radial_factor(*this, r * r) * r - target) / gradient;
    r -= step;
    if (std::abs(step) < 1e-12) return target > 0 ? Vector2(distorted * (r / target)) : Vector2(Vector2::Zero());
  }
  return std::nullopt;
}

Lens Lens::plus(const Parameters& step) const {
  return {f * std::exp(step[0]), cx + step[3], cy + step[4], k1 + step[1], k2 + step[2]};
}

Lens::Parameters Lens::minus(const Lens& from) const {
  Parameters step;
  step << std::log(f / from.f), k1 - from.k1, k2 - from.k2, cx - from.cx, cy - from.cy;
  return step;
}

}  // namespace relmap
