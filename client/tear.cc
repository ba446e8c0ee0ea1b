#include "client/tear.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/base/number_text.h"
#include "proto/geometry/covariance.h"

namespace relmap::client {

constexpr double kDegrees = 180 / std::numbers::pi;  // in a radian

std::string Tear::name() const { return edge.valid() ? edge.to_string() : "motion"; }

std::string Tear::words() const {
  return name() + " from " + a.to_string() + " to " + b.to_string() + ": " + fixed(metres, 3) + " m, " +
         fixed(degrees, 2) + " degrees, " + fixed(sigmas, 1) + " sigmas";
}

Tear strain_of(const Spring& spring, const SE3& T_root_a, const SE3& T_root_b) {
  const SE3 off = spring.relaxed.T_ab.inverse() * (T_root_a.inverse() * T_root_b);
  const Vector6 xi = off.log();
  const double sigmas = std::sqrt(std::max(0.0, mahalanobis_squared(xi, spring.relaxed.covariance)));
  return {spring.edge, spring.relaxed.a, spring.relaxed.b, off.t.norm(), kDegrees * xi.tail<3>().norm(), sigmas};
}

void sort_worst_first(std::vector<Tear>& tears) {
  std::stable_sort(tears.begin(), tears.end(), [](const Tear& x, const Tear& y) { return x.sigmas > y.sigmas; });
}

}  // namespace relmap::client
