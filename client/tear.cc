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

std::vector<std::string> tear_lines(const std::vector<Tear>& tears, const std::vector<Tear>& stretched,
                                    std::size_t max_lines) {
  std::vector<std::string> lines;
  if (tears.empty())
    lines.push_back("no tear: the picture stretches no edge by more than " + fixed(kTearSigmas, 0) + " sigmas");
  const std::size_t named = std::min(tears.size(), max_lines);
  for (std::size_t i = 0; i < named; ++i) lines.push_back("tear: " + tears[i].words());
  if (named < tears.size()) lines.push_back(count_text(tears.size()) + " tears in all");
  for (const Tear& closure : stretched)
    if (std::none_of(tears.begin(), tears.begin() + static_cast<std::ptrdiff_t>(named),
                     [&](const Tear& tear) { return tear.edge == closure.edge; }))
      lines.push_back("stretched closure: " + closure.words());
  return lines;
}

}  // namespace relmap::client
