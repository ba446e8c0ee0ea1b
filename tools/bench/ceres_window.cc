#include "tools/bench/ceres_window.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <set>

#include "storage/frame.h"

namespace relmap::bench {

namespace {

constexpr double kLeastDisparity = 1;  // px, of a first measurement: points further away make Ceres diverge

Eigen::Quaterniond quaternion(const double* q_t) { return Eigen::Quaterniond(q_t[3], q_t[0], q_t[1], q_t[2]); }

void put(const SE3& pose, double* q_t) {
  const Eigen::Quaterniond q = pose.quaternion().normalized();
  std::copy_n(q.coeffs().data(), 4, q_t);
  std::copy_n(pose.t.data(), 3, q_t + 4);
}

// T <- T Exp(xi). The Jacobians of the residuals are taken with respect to xi: the six columns after the first six of
// the ambient seven stay zero.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* result) const override {
    const SE3 pose =
        SE3::from_quaternion(quaternion(x), Vector3(x[4], x[5], x[6])) * SE3::exp(Eigen::Map<const Vector6>(delta));
    put(pose, result);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> J(jacobian);
    J.setZero();
    J.topRows<6>().setIdentity();
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

// A stereo measurement of a point in the world by a frame.
class StereoCost final : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  StereoCost(const StereoCamera& camera, const StereoPixel& z, double sigma)
      : camera_(camera), z_(z), weight_(1 / sigma) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Matrix3 R = quaternion(parameters[0]).toRotationMatrix();  // of T_world_frame
    const Vector3 t(parameters[0][4], parameters[0][5], parameters[0][6]);
    const Vector3 p = R.transpose() * (Eigen::Map<const Vector3>(parameters[1]) - t);
    if (!(p.z() > 1e-3)) return false;
    const double k = camera_.f / p.z();
    const Vector3 h(k * p.x() + camera_.cx, k * p.y() + camera_.cy, k * (p.x() - camera_.baseline) + camera_.cx);
    Eigen::Map<Vector3> r(residuals);
    r = weight_ * (h - z_);
    if (!jacobians) return true;
    Matrix3 d_p;  // dh / dp, whitened
    d_p << k, 0, -k * p.x() / p.z(), 0, k, -k * p.y() / p.z(), k, 0, -k * (p.x() - camera_.baseline) / p.z();
    d_p *= weight_;
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 3, 7, Eigen::RowMajor>> J(jacobians[0]);
      J.leftCols<3>() = -d_p;
      J.middleCols<3>(3) = d_p * skew(p);
      J.col(6).setZero();
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> J(jacobians[1]);
      J = d_p * R.transpose();
    }
    return true;
  }

 private:
  const StereoCamera& camera_;
  const StereoPixel z_;
  const double weight_;
};

}  // namespace

SE3 CeresWindow::pose(std::uint32_t frame) const {
  const double* x = poses_[frame].q_t;
  return SE3::from_quaternion(quaternion(x), Vector3(x[4], x[5], x[6]));
}

std::vector<SE3> CeresWindow::poses() const {
  std::vector<SE3> all;
  for (std::uint32_t i = 0; i < poses_.size(); ++i) all.push_back(pose(i));
  return all;
}

std::uint32_t CeresWindow::landmark_of(const TrackMeasurement& track) {
  const auto [it, fresh] = of_track_.try_emplace({track.track.sequence, track.track.index}, landmarks_.size());
  if (fresh) {
    const StereoPixel z = track.pixel();
    const double depth = camera_.f * camera_.baseline / std::max(z.x() - z.z(), kLeastDisparity);
    Landmark& landmark = landmarks_.emplace_back();
    const Vector3 position = pose(static_cast<std::uint32_t>(poses_.size()) - 1) *
                             (depth * Vector3((z.x() - camera_.cx) / camera_.f, (z.y() - camera_.cy) / camera_.f, 1));
    std::copy_n(position.data(), 3, landmark.position);
  }
  return it->second;
}

double CeresWindow::add(const Keyframe& keyframe) {
  const auto newest = static_cast<std::uint32_t>(poses_.size());
  const SE3 start = newest == 0 ? SE3() : pose(newest - 1) * (odometry_.inverse() * keyframe.T_odom_frame);
  odometry_ = keyframe.T_odom_frame;
  put(start, poses_.emplace_back().q_t);
  seen_.emplace_back();
  for (const TrackMeasurement& track : keyframe.tracks) {
    const std::uint32_t landmark = landmark_of(track);
    landmarks_[landmark].sightings.push_back({newest, track.pixel(), pixel_sigma(track.level)});
    seen_.back().push_back(landmark);
  }
  return adjust(newest);
}

double CeresWindow::adjust(std::uint32_t newest) {
  const auto begin = std::chrono::steady_clock::now();
  const std::uint32_t first = newest + 1 > options_.window ? newest + 1 - options_.window : 0;
  std::vector<std::uint32_t> window_landmarks;
  for (std::uint32_t frame = first; frame <= newest; ++frame)
    window_landmarks.insert(window_landmarks.end(), seen_[frame].begin(), seen_[frame].end());
  std::sort(window_landmarks.begin(), window_landmarks.end());
  window_landmarks.erase(std::unique(window_landmarks.begin(), window_landmarks.end()), window_landmarks.end());

  ceres::Problem::Options ownership;
  ownership.enable_fast_removal = false;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::HuberLoss huber(options_.huber);
  PoseManifold manifold;
  std::deque<StereoCost> costs;
  ceres::Problem problem(ownership);
  ceres::Solver::Options how;
  how.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::set<std::uint32_t> frames;
  for (const std::uint32_t landmark : window_landmarks) {
    double* position = landmarks_[landmark].position;
    problem.AddParameterBlock(position, 3);
    how.linear_solver_ordering->AddElementToGroup(position, 0);
    for (const Sighting& sighting : landmarks_[landmark].sightings) {
      double* q_t = poses_[sighting.frame].q_t;
      if (frames.insert(sighting.frame).second) {
        problem.AddParameterBlock(q_t, 7, &manifold);
        how.linear_solver_ordering->AddElementToGroup(q_t, 1);
        if (sighting.frame < first || sighting.frame == 0) problem.SetParameterBlockConstant(q_t);
      }
      problem.AddResidualBlock(&costs.emplace_back(camera_, sighting.z, sighting.sigma), &huber, q_t, position);
    }
  }
  how.linear_solver_type = ceres::DENSE_SCHUR;
  how.num_threads = 1;
  how.max_num_iterations = options_.max_iterations;
  how.function_tolerance = options_.relative_decrease;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace relmap::bench
