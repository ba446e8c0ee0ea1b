#include "frontend/vision/three_point.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <utility>

namespace relmap::vision {

namespace {

constexpr int kPolished = 3;               // steps of Gauss and Newton
constexpr double kMaxResidual = 1e-9;      // relative, of the squared distances between the points
constexpr double kMaxSkew = 1e-5;          // of a rotation
constexpr double kMinIndependent = 1e-10;  // sine of the angle at a point, below which three points lie on a line

// A real root of x^3 + b x^2 + c x + d.
double real_root(double b, double c, double d) {
  const auto value = [&](double x) { return ((x + b) * x + c) * x + d; };
  // Newton's method converges monotonically from beyond the outermost extremum, on the side of the inflection at which
  // the root lies.
  const double inflection = -b / 3;
  const double spread = b * b - 3 * c;  // of the extrema, squared and times nine
  double x = inflection;
  if (spread > 0) {
    const double outside = 2 * std::sqrt(spread) / 3;
    x += value(inflection) > 0 ? -outside : outside;
  } else if (value(inflection) != 0) {
    x -= std::cbrt(value(inflection));
  }
  for (int i = 0; i < 50; ++i) {
    const double slope = (3 * x + 2 * b) * x + c;
    if (slope == 0) break;
    const double step = value(x) / slope;
    x -= step;
    if (std::abs(step) <= 1e-15 * std::abs(x)) break;
  }
  return x;
}

// det(A + x B), as coefficients of x^0 to x^3.
std::array<double, 4> determinant_of_sum(const Matrix3& A, const Matrix3& B) {
  const auto det = [](const Vector3& x, const Vector3& y, const Vector3& z) { return x.dot(y.cross(z)); };
  return {A.determinant(),
          det(B.col(0), A.col(1), A.col(2)) + det(A.col(0), B.col(1), A.col(2)) + det(A.col(0), A.col(1), B.col(2)),
          det(A.col(0), B.col(1), B.col(2)) + det(B.col(0), A.col(1), B.col(2)) + det(B.col(0), B.col(1), A.col(2)),
          B.determinant()};
}

// The equations d' M_k d = a_k of the points' distances d.
struct Distances {
  std::array<Matrix3, 3> M;
  Vector3 squared;  // distances between the points: 0 and 1, 0 and 2, 1 and 2

  // Improves approximate distances; nothing if they solve no equation.
  std::optional<Vector3> polished(Vector3 d) const {
    Vector3 residual;
    for (int step = 0;; ++step) {
      Matrix3 J;
      for (int k = 0; k < 3; ++k) {
        const Vector3 Md = M[static_cast<std::size_t>(k)] * d;
        residual[k] = d.dot(Md) - squared[k];
        J.row(k) = 2 * Md.transpose();
      }
      if (step == kPolished) break;
      const Vector3 change = J.inverse() * residual;
      if (!change.allFinite()) break;
      d -= change;
    }
    const bool solved = residual.cwiseAbs().maxCoeff() <= kMaxResidual * squared.maxCoeff();
    return solved && d.minCoeff() > 0 ? std::optional(d) : std::nullopt;
  }
};

Distances distances_of(const std::array<Vector3, 3>& points, const std::array<Vector3, 3>& unit_rays) {
  Distances equations;
  constexpr std::array<std::pair<std::size_t, std::size_t>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [i, j] = kPairs[k];
    Matrix3& M = equations.M[k] = Matrix3::Zero();
    const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
    M(row, row) = M(column, column) = 1;
    M(row, column) = M(column, row) = -unit_rays[i].dot(unit_rays[j]);
    equations.squared[static_cast<Eigen::Index>(k)] = (points[i] - points[j]).squaredNorm();
  }
  return equations;
}

// Calls visit(d) for the directions d, of either sign, with d' conic d = 0 in the plane with this normal.
template <typename Visit>
void cut(const Matrix3& conic, const Vector3& normal, const Visit& visit) {
  const Vector3 u = normal.unitOrthogonal(), v = normal.cross(u).normalized();
  const double uu = u.dot(conic * u), uv = u.dot(conic * v), vv = v.dot(conic * v);
  const double discriminant = uv * uv - uu * vv;
  if (!(discriminant >= 0)) return;
  // d = x u + y v with uu x^2 + 2 uv x y + vv y^2 = 0; the larger root of the two forms does not cancel.
  const double larger = -(uv + std::copysign(std::sqrt(discriminant), uv));
  visit(Vector3(larger * u + uu * v));
  visit(Vector3(vv * u + larger * v));
}

}  // namespace

ThreePointPoses three_point_poses(const std::array<Vector3, 3>& points, const std::array<Vector3, 3>& rays) {
  ThreePointPoses poses;
  const Vector3 side = points[1] - points[0], other_side = points[2] - points[0];
  const Vector3 normal = side.cross(other_side);
  if (!(normal.norm() > kMinIndependent * side.norm() * other_side.norm())) return poses;
  const std::array<Vector3, 3> unit{rays[0].normalized(), rays[1].normalized(), rays[2].normalized()};
  const Distances equations = distances_of(points, unit);
  const Vector3& a = equations.squared;

  // Both conics are zero at all solutions; so is each of their combinations.
  Matrix3 first = (a[2] * equations.M[0] - a[0] * equations.M[2]) / a.maxCoeff();
  Matrix3 second = (a[2] * equations.M[1] - a[1] * equations.M[2]) / a.maxCoeff();
  if (std::abs(first.determinant()) > std::abs(second.determinant())) std::swap(first, second);
  const auto c = determinant_of_sum(first, second);
  if (c[3] == 0) return poses;
  const double x = real_root(c[2] / c[3], c[1] / c[3], c[0] / c[3]);
  const Matrix3 lines = first + x * second;
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen = Eigen::SelfAdjointEigenSolver<Matrix3>().computeDirect(lines);
  // The singular one of three real eigenvalues, ascending, is the middle one if the lines are real.
  const Vector3 low = eigen.eigenvectors().col(0), high = eigen.eigenvectors().col(2);
  if (!(eigen.eigenvalues()[0] < 0 && eigen.eigenvalues()[2] > 0)) return poses;
  const double s = std::sqrt(-eigen.eigenvalues()[0] / eigen.eigenvalues()[2]);
  const Matrix3& conic = std::abs(x) > 1 ? first : second;

  Matrix3 in_reference;
  in_reference << side, other_side, normal;
  const Matrix3 from_reference = in_reference.inverse();
  for (const double sign : {s, -s})
    cut(conic, high - sign * low, [&](Vector3 d) {
      if (d.sum() < 0) d = -d;
      Eigen::Index widest = 0;
      a.maxCoeff(&widest);
      const double length = d.dot(equations.M[static_cast<std::size_t>(widest)] * d);
      if (!(length > 0)) return;
      const auto distances = equations.polished(d * std::sqrt(a[widest] / length));
      if (!distances || poses.count == poses.T_camera_reference.size()) return;
      const Vector3 p0 = (*distances)[0] * unit[0];
      const Vector3 p1 = (*distances)[1] * unit[1] - p0, p2 = (*distances)[2] * unit[2] - p0;
      Matrix3 in_camera;
      in_camera << p1, p2, p1.cross(p2);
      const Matrix3 R = in_camera * from_reference;
      if (!((R * R.transpose() - Matrix3::Identity()).norm() < kMaxSkew))
        return;  // rounding, of points nearly on a line
      poses.T_camera_reference[poses.count++] = {R, p0 - R * points[0]};
    });
  return poses;
}

}  // namespace relmap::vision
