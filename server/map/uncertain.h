// A transform with its covariance, for tests of the consistency of closures (docs/method.md, 7).
#pragma once

#include <cmath>

#include "proto/geometry/geometry.h"
#include "server/place/map_points.h"

namespace relmap::map {

// Systematic error of odometry, which covariances do not include: standard deviations of position over the distance,
// and of rotation per metre (radians).
struct Drift {
  double share = 0, radians = 0;
};

// The 99 % quantile of chi-square with six degrees of freedom.
inline constexpr double kChi2With6At99 = 16.812;

struct Uncertain {
  SE3 T;
  Matrix6 covariance = Matrix6::Zero();  // of T Exp(xi)

  explicit Uncertain(const SE3& T_in = {}, const Matrix6& covariance_in = Matrix6::Zero())
      : T(T_in), covariance(covariance_in) {}
  // A path along the odometry.
  Uncertain(const place::PlacedFrame& placed, Drift drift) : T(placed.T_centre_frame), covariance(placed.covariance) {
    covariance.diagonal().head<3>().array() += std::pow(drift.share * placed.way, 2);
    covariance.diagonal().tail<3>().array() += std::pow(drift.radians * placed.way, 2);
  }

  Uncertain inverse() const { return Uncertain(T.inverse(), inverse_covariance(T, covariance)); }
  Uncertain operator*(const Uncertain& next) const {
    return Uncertain(T * next.T, compound_covariance(covariance, next.T, next.covariance));
  }
};

}  // namespace relmap::map
