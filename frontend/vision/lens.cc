#include "frontend/vision/lens.h"

#include <cmath>

namespace relmap::vision {

namespace {

double radial_factor(const Lens& lens, double r2) { return 1 + r2 * (lens.k1 + r2 * lens.k2); }

}  // namespace

Vector2 Lens::project(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  return f * radial_factor(*this, x.squaredNorm()) * Vector2(x.x(), aspect * x.y()) + Vector2(cx, cy);
}

Lens::PointJacobian Lens::jacobian(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  const double r2 = x.squaredNorm();
  PointJacobian normalised;  // dx/dp
  normalised << 1, 0, -x.x(), 0, 1, -x.y();
  normalised /= p.z();
  const Eigen::Matrix2d distorted =
      radial_factor(*this, r2) * Eigen::Matrix2d::Identity() + 2 * (k1 + 2 * k2 * r2) * x * x.transpose();  // d(g x)/dx
  PointJacobian J = f * distorted * normalised;
  J.row(1) *= aspect;
  return J;
}

Lens::LensJacobian Lens::lens_jacobian(const Vector3& p) const {
  const Vector2 x = p.head<2>() / p.z();
  const double r2 = x.squaredNorm();
  const Vector2 seen(f * x.x(), f * aspect * x.y());  // without distortion, from the principal point
  const double g = radial_factor(*this, r2);
  LensJacobian J;
  J << g * seen, r2 * seen, r2 * r2 * seen, Vector2(1, 0), Vector2(0, 1), Vector2(0, g * seen.y());
  return J;
}

std::optional<Vector2> Lens::undistort(const Vector2& pixel) const {
  constexpr int kMaxIterations = 50;
  const Vector2 distorted((pixel.x() - cx) / f, (pixel.y() - cy) / (aspect * f));
  const double target = distorted.norm();
  double r = target;  // Newton's: g(r) r = target
  for (int i = 0; i < kMaxIterations; ++i) {
    const double gradient = slope(r * r);
    if (!(gradient > kMinSlope)) return std::nullopt;
    const double step = (radial_factor(*this, r * r) * r - target) / gradient;
    r -= step;
    if (std::abs(step) < 1e-12) return target > 0 ? Vector2(distorted * (r / target)) : Vector2(Vector2::Zero());
  }
  return std::nullopt;
}

Lens Lens::plus(const Parameters& step) const {
  return {f * std::exp(step[kLogF]),          cx + step[kCx], cy + step[kCy], k1 + step[kK1], k2 + step[kK2],
          aspect * std::exp(step[kLogAspect])};
}

Lens::Parameters Lens::minus(const Lens& from) const {
  Parameters step;
  step << std::log(f / from.f), k1 - from.k1, k2 - from.k2, cx - from.cx, cy - from.cy, std::log(aspect / from.aspect);
  return step;
}

}  // namespace relmap::vision
