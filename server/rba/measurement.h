// How a camera measures a landmark that is stored by inverse depth in another frame (docs/method.md, 3).
//
// The landmark q = (a, b, 1), rho = 1/z in its base j is, in the observing frame i and scaled by rho,
//
//   s = R_ij q + rho t_ij,      h = (f s_x/s_z + cx, f s_y/s_z + cy, f (s_x - rho B)/s_z + cx).
//
// With T_ij <- T_ij Exp(theta) the Jacobians share the factor G = (dh/ds) R_ij:
//
//   dh/dtheta = G E,   E = [ rho I | -[q]x ]   (E is the landmark's, the same for every observer)
//   dh/d(a, b, rho) = [ G e1, G e2, (dh/ds) t_ij - (0, 0, f B / s_z) ].
//
// A mono measurement has no third row: it is zero.
#pragma once

#include <cmath>
#include <numbers>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::rba {

// s_z is the ratio of the depths in i and j. A point with a smaller ratio counts as behind the camera.
inline constexpr double kMinDepthRatio = 1e-3;
inline constexpr double kMinInverseDepth = 1e-5;  // per metre

inline Vector3 ray(const Vector3& abr) { return {abr.x(), abr.y(), 1}; }
inline Vector3 scaled_point(const SE3& T_ij, const Vector3& abr) { return T_ij.R * ray(abr) + abr.z() * T_ij.t; }

// Predicts h from s and the landmark's rho. False if the point is not in front of the camera.
inline bool predict(const StereoCamera& camera, const Vector3& s, double rho, StereoPixel* h) {
  if (!(s.z() > kMinDepthRatio)) return false;
  const double k = camera.f / s.z();
  *h = {k * s.x() + camera.cx, k * s.y() + camera.cy, k * (s.x() - rho * camera.baseline) + camera.cx};
  return true;
}

// z - h in pixels; the third component is zero for a mono measurement.
inline Vector3 residual(const StereoPixel& z, bool mono, const StereoPixel& h) {
  return {z.x() - h.x(), z.y() - h.y(), mono ? 0 : z.z() - h.z()};
}

struct MeasurementJacobian {
  Matrix3 G;           // (dh/ds) R_ij
  Matrix3 d_landmark;  // dh/d(a, b, rho)
};

inline MeasurementJacobian measurement_jacobian(const StereoCamera& camera, const SE3& T_ij, const Vector3& s,
                                                double rho, bool mono) {
  const double inverse = 1 / s.z();
  const double k = camera.f * inverse;
  const double x = s.x() * inverse, y = s.y() * inverse;
  // The rows of dh/ds are k (1, 0, -x), k (0, 1, -y), k (1, 0, -(s_x - rho B)/s_z).
  const double x_right = x - rho * camera.baseline * inverse;
  const double on = mono ? 0 : 1;
  MeasurementJacobian j;
  j.G.row(0) = k * (T_ij.R.row(0) - x * T_ij.R.row(2));
  j.G.row(1) = k * (T_ij.R.row(1) - y * T_ij.R.row(2));
  j.G.row(2) = on * k * (T_ij.R.row(0) - x_right * T_ij.R.row(2));
  j.d_landmark.col(0) = j.G.col(0);
  j.d_landmark.col(1) = j.G.col(1);
  j.d_landmark.col(2) = Vector3(k * (T_ij.t.x() - x * T_ij.t.z()), k * (T_ij.t.y() - y * T_ij.t.z()),
                                on * k * (T_ij.t.x() - camera.baseline - x_right * T_ij.t.z()));
  return j;
}

// d theta_i / d xi_c for an edge c between x and y on the path from the base j to i, where x is nearer to j. It is the
// same for every i beyond the edge. `forward`: the edge is stored along the path, as T_xy.
inline Matrix6 edge_to_theta(bool forward, const SE3& T_jx, const SE3& T_jy) {
  return forward ? Matrix6(-T_jy.adjoint()) : T_jx.adjoint();
}

// With Huber's loss with the corner at k (proto/linear/huber.h): the factor between the covariance and the inverse of
// the weighted normal equations, which overstates it, if residuals are Gaussian in three coordinates: E[psi^2] E[w] /
// E[psi']^2 per coordinate, with psi = w r (Huber, Robust Statistics, 1981, 7.6).
inline double huber_covariance_factor(double k) {
  const double below = std::erf(k / std::numbers::sqrt2), c = std::sqrt(2 / std::numbers::pi) * std::exp(-k * k / 2);
  const double weight = below;             // P(e < k) + k E[1/e; e > k]
  const double slope = below - c * k / 3;  // E[psi'], averaged over directions
  const double square = below - c * (k * k * k + 3 * k) / 3 + k * k * (1 - below + c * k) / 3;
  return square * weight / (slope * slope);
}

}  // namespace relmap::rba
