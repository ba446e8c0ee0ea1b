#include "storage/graph/precision.h"

#include <algorithm>
#include <cmath>

namespace relmap::storage {

namespace {

constexpr double kRotationStep = 0x1p-34;
constexpr double kTranslationStep = 0x1p-27;  // metres
constexpr double kMaxMetres = 0x1p30;         // metres
constexpr double kCorrelationSteps = 127;
constexpr double kMinPart = 0.499;  // one part of a unit quaternion is 0.5 or more

// Volatile, because GCC 12 drops both conversions from -O2 on where it vectorises them.
double single(double value) {
  const volatile float kept = static_cast<float>(value);
  return kept;
}

// The result is never below `rho`, so that an inverse depth at its minimum stays there.
float inverse_depth(double rho) {
  const auto value = static_cast<float>(rho);
  return value < rho ? std::nextafter(value, 1.0F) : value;
}

}  // namespace

std::optional<PoseGrid> to_grid(const SE3& T) {
  if (!T.R.allFinite() || !(T.t.cwiseAbs().maxCoeff() < kMaxMetres)) return std::nullopt;
  const Eigen::Quaterniond q(T.R);
  if (!(std::abs(q.norm() - 1) < 0.1)) return std::nullopt;  // not a rotation
  const std::array<double, 4> parts = {q.w(), q.x(), q.y(), q.z()};
  PoseGrid grid;
  while (grid.left_out < 3 && std::abs(parts[static_cast<std::size_t>(grid.left_out)]) < kMinPart) ++grid.left_out;
  const double sign = parts[static_cast<std::size_t>(grid.left_out)] < 0 ? -1 : 1;
  std::size_t next = 0;
  for (std::size_t i = 0; i < 4; ++i)
    if (static_cast<int>(i) != grid.left_out) grid.rotation[next++] = std::llround(sign * parts[i] / kRotationStep);
  for (std::size_t i = 0; i < 3; ++i)
    grid.translation[i] = std::llround(T.t[static_cast<Eigen::Index>(i)] / kTranslationStep);
  return grid;
}

SE3 from_grid(const PoseGrid& grid) {
  std::array<double, 4> parts{};
  double rest = 1;
  std::size_t next = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (static_cast<int>(i) == grid.left_out) continue;
    parts[i] = static_cast<double>(grid.rotation[next++]) * kRotationStep;
    rest -= parts[i] * parts[i];
  }
  parts[static_cast<std::size_t>(grid.left_out)] = std::sqrt(std::max(rest, 0.0));
  SE3 T;
  T.R = Eigen::Quaterniond(parts[0], parts[1], parts[2], parts[3]).toRotationMatrix();
  for (std::size_t i = 0; i < 3; ++i)
    T.t[static_cast<Eigen::Index>(i)] = static_cast<double>(grid.translation[i]) * kTranslationStep;
  return T;
}

std::array<std::int8_t, 36> to_correlation(const Matrix6& with_previous, const Matrix6& own, const Matrix6& previous) {
  std::array<std::int8_t, 36> correlation{};
  for (Eigen::Index column = 0; column < 6; ++column)
    for (Eigen::Index row = 0; row < 6; ++row) {
      const double part = with_previous(row, column) / std::sqrt(own(row, row) * previous(column, column));
      if (std::isfinite(part))
        correlation[static_cast<std::size_t>(6 * column + row)] =
            static_cast<std::int8_t>(std::lround(kCorrelationSteps * std::clamp(part, -1.0, 1.0)));
    }
  return correlation;
}

Matrix6 from_correlation(const std::array<std::int8_t, 36>& correlation, const Matrix6& own, const Matrix6& previous) {
  const Vector6 own_sigma = own.diagonal().cwiseMax(0).cwiseSqrt();
  const Vector6 previous_sigma = previous.diagonal().cwiseMax(0).cwiseSqrt();
  Matrix6 parts;
  for (std::size_t k = 0; k < correlation.size(); ++k)
    parts.data()[k] = std::max(correlation[k] / kCorrelationSteps, -1.0);
  return own_sigma.asDiagonal() * parts * previous_sigma.asDiagonal();
}

SE3 rounded(const SE3& T) {
  const auto grid = to_grid(T);
  return grid ? from_grid(*grid) : T;
}

Matrix6 rounded(const Matrix6& m) {
  Matrix6 result;
  for (int column = 0; column < 6; ++column)
    for (int row = column; row < 6; ++row) {
      const auto value = static_cast<float>(m(row, column));
      if (!std::isfinite(value)) return m;
      result(row, column) = result(column, row) = value;
    }
  return result;
}

void round_estimates(FrameHot& frame) {
  frame.T_odom_frame = rounded(frame.T_odom_frame);
  for (Edge& edge : frame.edges) {
    edge.T_ab = rounded(edge.T_ab);
    edge.prior_T_ab = rounded(edge.prior_T_ab);
    edge.covariance = rounded(edge.covariance);
    edge.prior_covariance = rounded(edge.prior_covariance);
  }
  for (Landmark& landmark : frame.landmarks) {
    const Vector3 value(single(landmark.abr.x()), single(landmark.abr.y()), inverse_depth(landmark.abr.z()));
    if (value.allFinite()) landmark.abr = value;
  }
}

}  // namespace relmap::storage
