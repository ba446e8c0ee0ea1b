// Ceres cost functions for stereo measurements in one Euclidean frame, for the comparisons with Ceres.
#pragma once

#include <ceres/ceres.h>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::bench {

struct CeresPose {
  double q_t[7] = {};  // T_world_frame: quaternion x, y, z, w; translation

  CeresPose() = default;
  explicit CeresPose(const SE3& T_world_frame);
  SE3 pose() const;
};

// Options of a problem that owns neither its costs nor its loss and manifold.
inline ceres::Problem::Options owning_nothing() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

// T <- T Exp(xi). The Jacobians of the residuals are taken with respect to xi: the six columns after the first six of
// the ambient seven stay zero.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* result) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

// The whitened residual of a point in the world, measured by a frame; u_right of a mono measurement has no weight.
class StereoCost final : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  StereoCost(const StereoCamera& camera, const StereoPixel& z, bool mono, double sigma)
      : camera_(camera), z_(z), weight_(1 / sigma, 1 / sigma, mono ? 0 : 1 / sigma) {
    if (mono) z_.z() = 0;
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  const StereoCamera& camera_;
  StereoPixel z_;
  const Vector3 weight_;
};

}  // namespace relmap::bench
