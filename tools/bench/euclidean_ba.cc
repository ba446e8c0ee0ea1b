#include "tools/bench/euclidean_ba.h"

#include <chrono>
#include <cmath>
#include <deque>
#include <limits>

#include "server/rba/local_map.h"
#include "server/rba/measurement.h"
#include "storage/graph/path_tree.h"
#include "tools/bench/stopwatch.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kAll = std::numeric_limits<std::uint32_t>::max();

}  // namespace

EuclideanBa::EuclideanBa(storage::Map& map) {
  const storage::Session first = map.sessions().front();
  const storage::PathTree tree =
      storage::build_path_tree(map, {first.number, first.first}, {.depth = kAll, .frames = kAll, .until = {}});
  const std::vector<SE3> unrolled = storage::poses_along(map, tree);
  rba::LocalMap local(map);
  std::vector<std::int32_t> frames;
  for (std::size_t n = 0; n < unrolled.size(); ++n) {
    index_.emplace(tree.nodes[n].frame, n);
    poses_.emplace_back(unrolled[n]);
    frames.push_back(local.frame(tree.nodes[n].frame));
    local.load_observations(frames.back());
  }
  cameras_ = local.cameras;
  std::vector<std::int64_t> point_of(local.landmarks.size(), -1);
  for (const rba::LocalObservation& seen : local.observations) {
    const rba::LocalLandmark& landmark = local.landmarks[static_cast<std::size_t>(seen.landmark)];
    const auto base = index_.find(landmark.id.base);
    if (base == index_.end() || landmark.depth_prior) continue;
    std::int64_t& point = point_of[static_cast<std::size_t>(seen.landmark)];
    if (point < 0) {
      point = static_cast<std::int64_t>(points_.size());
      const Vector3 position = unrolled[base->second] * Vector3(rba::ray(landmark.abr) / landmark.abr.z());
      std::copy_n(position.data(), 3, points_.emplace_back().position);
    }
    const storage::LocalFrame& by = local.frames[static_cast<std::size_t>(seen.frame)];
    observations_.push_back({index_.at(by.id), static_cast<std::uint32_t>(point),
                             &cameras_[local.view(seen.frame).camera], seen.z, seen.mono,
                             1 / std::sqrt(seen.information)});
  }
}

EuclideanBa::Outcome EuclideanBa::solve(double huber, int max_iterations) {
  const auto begin = std::chrono::steady_clock::now();
  ceres::HuberLoss loss(huber);
  PoseManifold manifold;
  std::deque<StereoCost> costs;
  ceres::Problem problem(owning_nothing());
  ceres::Solver::Options how;
  how.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (CeresPose& pose : poses_) {
    problem.AddParameterBlock(pose.q_t, 7, &manifold);
    how.linear_solver_ordering->AddElementToGroup(pose.q_t, 1);
  }
  problem.SetParameterBlockConstant(poses_.front().q_t);
  for (Point& point : points_) {
    problem.AddParameterBlock(point.position, 3);
    how.linear_solver_ordering->AddElementToGroup(point.position, 0);
  }
  for (const Seen& seen : observations_)
    problem.AddResidualBlock(&costs.emplace_back(*seen.camera, seen.z, seen.mono, seen.sigma), &loss,
                             poses_[seen.frame].q_t, points_[seen.point].position);
  how.linear_solver_type = ceres::SPARSE_SCHUR;
  how.num_threads = 1;
  how.max_num_iterations = max_iterations;
  how.function_tolerance = 1e-14;
  how.gradient_tolerance = 1e-9;
  how.parameter_tolerance = 1e-13;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  if (summary.termination_type == ceres::FAILURE || (max_iterations > 0 && !summary.IsSolutionUsable()))
    throw StatusError(Status(Reason::NUMERICAL, "Ceres: " + summary.message));
  return {2 * summary.initial_cost, 2 * summary.final_cost, static_cast<int>(summary.iterations.size()),
          summary.termination_type == ceres::CONVERGENCE, seconds_since(begin)};
}

double EuclideanBa::rms_px() const {
  double sum = 0, coordinates = 0;
  for (const Seen& seen : observations_) {
    const Vector3 p =
        poses_[seen.frame].pose().inverse() * Vector3(Eigen::Map<const Vector3>(points_[seen.point].position));
    StereoPixel h;
    if (!rba::predict(*seen.camera, p, 1, &h)) continue;
    sum += rba::residual(seen.z, seen.mono, h).squaredNorm();
    coordinates += seen.mono ? 2 : 3;
  }
  return std::sqrt(sum / coordinates);
}

}  // namespace relmap::bench
