#include "proto/geometry/canonical_rotation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relmap {

namespace {

constexpr double kGrid = 0x1p46;  // far coarser than the error of the conversion to a matrix and back (a few 2^-53)
constexpr double kTie = 1e-9;     // components this close count as equal, so that noise does not choose between them
constexpr double kUnitLength = 1e-6;  // tolerance of a quaternion's length
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

QuaternionWxyz on_grid(const Matrix3& rotation) {
  const Eigen::Quaterniond e(rotation);
  QuaternionWxyz q = {e.w(), e.x(), e.y(), e.z()};
  double max_abs = 0;
  for (const double c : q) max_abs = std::max(max_abs, std::abs(c));
  std::size_t largest = 0;
  while (largest < 3 && !(std::abs(q[largest]) >= max_abs - kTie)) ++largest;

  double rest = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == largest) continue;
    q[i] = std::round(q[i] * kGrid) / kGrid;
    rest -= q[i] * q[i];
  }
  q[largest] = std::copysign(std::sqrt(rest), q[largest]);
  const auto first = std::find_if(q.begin(), q.end(), [](double c) { return c != 0; });
  const double sign = first != q.end() && *first < 0 ? -1 : 1;
  for (double& c : q) c = c * sign + 0.0;  // + 0.0: no negative zero
  return q;
}

}  // namespace

QuaternionWxyz canonical_quaternion(const Matrix3& rotation) {
  if (!rotation.allFinite()) return {kNaN, kNaN, kNaN, kNaN};
  if (!is_rotation(rotation)) return {};
  QuaternionWxyz q = on_grid(rotation);
  // Rounding can move a pair of components across the threshold kTie; repeating reaches a fixed point.
  for (int i = 0; i < 4; ++i) {
    const QuaternionWxyz again = on_grid(rotation_of(q));
    if (again == q) break;
    q = again;
  }
  return q;
}

Matrix3 rotation_of(const QuaternionWxyz& wxyz) {
  Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  if (!q.coeffs().allFinite()) return Matrix3::Constant(kNaN);
  if (std::abs(q.norm() - 1) > kUnitLength) return Matrix3::Zero();
  return q.normalized().toRotationMatrix();
}

bool is_rotation(const Matrix3& R) {
  if (!R.allFinite()) return false;
  const double off = (R * R.transpose() - Matrix3::Identity()).cwiseAbs().maxCoeff();
  return off < 1e-5 && R.determinant() > 0;
}

}  // namespace relmap
