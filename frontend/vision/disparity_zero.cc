#include "frontend/vision/disparity_zero.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "proto/geometry/geometry.h"

namespace relmap::vision {

namespace {

constexpr int kMinCorners = 30;
constexpr double kMinShare = 0.3;   // of the corners must agree
constexpr double kMaxStartYaw = 3;  // degrees; searches start from yaws up to this to either side
constexpr int kStarts = 12;         // starts to either side
constexpr double kFirstTolerance = 30, kLastTolerance = 0.5;  // pixels of residual, first and last scale of the kernel

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

// The left camera's motion, as it acts on rays: X' = R x + T (disparity - zero).
struct RayMotion {
  Matrix3 R = Matrix3::Identity();
  Vector3 T = Vector3::Zero();
  double zero = 0;
};

class Fit {
 public:
  Fit(const std::vector<MovedCorner>& corners, const StereoCamera& camera) : corners_(corners), camera_(camera) {}

  // Two residuals and their derivatives by rotation, T and zero. False if the point is behind the camera.
  bool linearise(const MovedCorner& c, const RayMotion& motion, Eigen::Vector2d& residual,
                 Eigen::Matrix<double, 2, 7>& J) const {
    const Vector3 ray((c.u - camera_.cx) / camera_.f, (c.v - camera_.cy) / camera_.f, 1);
    const Vector3 turned = motion.R * ray;
    const double disparity = c.disparity - motion.zero;
    const Vector3 X = turned + disparity * motion.T;
    if (!(X.z() > 0.05)) return false;
    const double s = camera_.f / X.z();
    residual << c.u_later - (s * X.x() + camera_.cx), c.v_later - (s * X.y() + camera_.cy);
    Eigen::Matrix<double, 2, 3> H;
    H << s, 0, -s * X.x() / X.z(), 0, s, -s * X.y() / X.z();
    J.leftCols<3>() = -H * skew(turned);
    J.middleCols<3>(3) = disparity * H;
    J.col(6) = -H * motion.T;
    return true;
  }

  // Geman-McClure cost. It is bounded, so that things that move by themselves count no more than mismatches.
  double cost(const RayMotion& motion, double scale) const {
    double sum = 0;
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 7> J;
    for (const MovedCorner& c : corners_)
      sum += linearise(c, motion, r, J) ? r.squaredNorm() / (scale * scale + r.squaredNorm()) : 1;
    return sum;
  }

  // Gauss-Newton over `unknowns` parameters: 6 (zero is held) or 7. The scale of the kernel falls from `from` to `to`.
  // Returns the information matrix for residuals of one pixel.
  Matrix7 refine(RayMotion& motion, int unknowns, double from, double to, int rounds) const {
    Matrix7 A = Matrix7::Zero();
    for (int round = 0; round < rounds; ++round) {
      const double scale = std::max(to, from * std::pow(0.5, round));
      A = Matrix7::Identity() * 1e-9;
      Vector7 b = Vector7::Zero();
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 7> J;
      for (const MovedCorner& c : corners_) {
        if (!linearise(c, motion, r, J)) continue;
        const double share = scale * scale / (scale * scale + r.squaredNorm());
        A += share * share * J.transpose() * J;
        b += share * share * J.transpose() * r;
      }
      const Eigen::VectorXd step = A.topLeftCorner(unknowns, unknowns).ldlt().solve(b.head(unknowns));
      if (!step.allFinite()) break;
      motion.R = so3_exp(step.head<3>()) * motion.R;
      motion.T += step.segment<3>(3);
      if (unknowns == 7) motion.zero += std::clamp(step[6], -2.0, 2.0);
    }
    return A;
  }

  // Counts the corners whose residual is at most `max_residual`; `variance` is their mean squared residual a
  // coordinate.
  int agreeing(const RayMotion& motion, double max_residual, double& variance) const {
    int count = 0;
    double sum = 0;
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 7> J;
    for (const MovedCorner& c : corners_) {
      if (!linearise(c, motion, r, J) || r.norm() > max_residual) continue;
      ++count;
      sum += r.squaredNorm() / 2;
    }
    variance = count > 0 ? sum / count : 0;
    return count;
  }

 private:
  const std::vector<MovedCorner>& corners_;
  const StereoCamera& camera_;
};

}  // namespace

std::optional<DisparityZero> disparity_zero(const std::vector<MovedCorner>& corners, const StereoCamera& camera) {
  if (corners.size() < kMinCorners) return {};
  const Fit fit(corners, camera);
  const double step = camera.f * std::tan(kMaxStartYaw * M_PI / 180) / kStarts;
  std::optional<RayMotion> best;
  double min_cost = 0;
  for (int start = -kStarts; start <= kStarts; ++start) {
    RayMotion motion;
    motion.zero = start * step;
    fit.refine(motion, 6, kFirstTolerance, 2, 8);
    fit.refine(motion, 7, 2, 2, 4);
    const double cost = fit.cost(motion, 2);
    if (!best || cost < min_cost) best = motion, min_cost = cost;
  }
  Matrix7 information = fit.refine(*best, 7, 1, kLastTolerance, 6);
  double variance = 0;
  DisparityZero found;
  found.corners = fit.agreeing(*best, 3 * kLastTolerance, variance);
  if (found.corners < std::max(kMinCorners, static_cast<int>(kMinShare * static_cast<double>(corners.size()))))
    return {};
  found.pixels = best->zero;
  found.sigma = std::sqrt(std::max(variance, 0.01) * information.inverse()(6, 6));
  if (!(found.sigma <= kMaxZeroSigma)) return {};
  return found;
}

}  // namespace relmap::vision
