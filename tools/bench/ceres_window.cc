#include "tools/bench/ceres_window.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <set>

#include "storage/graph/frame.h"
#include "tools/bench/stopwatch.h"

namespace relmap::bench {

namespace {

constexpr double kMinDisparity = 1;  // px, of a first measurement: points further away make Ceres diverge

}  // namespace

SE3 CeresWindow::pose(std::uint32_t frame) const { return poses_[frame].pose(); }

std::vector<SE3> CeresWindow::poses() const {
  std::vector<SE3> all;
  for (std::uint32_t i = 0; i < poses_.size(); ++i) all.push_back(pose(i));
  return all;
}

std::uint32_t CeresWindow::landmark_of(const TrackMeasurement& track) {
  const auto [it, fresh] = of_track_.try_emplace({track.track.sequence, track.track.index}, landmarks_.size());
  if (fresh) {
    const StereoPixel z = track.pixel();
    const double disparity = is_mono(z) ? kMinDisparity : std::max(z.x() - z.z(), kMinDisparity);
    const double depth = camera_.f * camera_.baseline / disparity;
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
  poses_.emplace_back(start);
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

  ceres::HuberLoss huber(options_.huber);
  PoseManifold manifold;
  std::deque<StereoCost> costs;
  ceres::Problem problem(owning_nothing());
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
      problem.AddResidualBlock(&costs.emplace_back(camera_, sighting.z, is_mono(sighting.z), sighting.sigma), &huber,
                               q_t, position);
    }
  }
  how.linear_solver_type = ceres::DENSE_SCHUR;
  how.num_threads = 1;
  how.max_num_iterations = options_.max_iterations;
  how.function_tolerance = options_.relative_decrease;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  return seconds_since(begin);
}

}  // namespace relmap::bench
