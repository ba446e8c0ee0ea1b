#include "server/rba/rba.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/rba/levenberg_marquardt.h"
#include "server/rba/local_map.h"
#include "server/rba/mean_errors.h"
#include "server/rba/region.h"
#include "storage/precision.h"

namespace relmap {

namespace {

// Edges between a marginal covariance that is believed and the nearest static frame (docs/method.md, 3).
constexpr std::uint32_t kCovarianceDistance = 5;
// The reduced system is dense: a ripple that reaches further goes on in idle time, from where this one ended.
constexpr std::size_t kMostActiveFrames = 64;
constexpr int kFullIterations = 100;
constexpr double kFullRelativeDecrease = 1e-12;

// One relaxation: a region, solved, widened by those whom that moved, solved again.
class Relaxation {
 public:
  Relaxation(Map& map, const RbaOptions& options, double delta_eps, std::uint64_t budget, RbaSummary* summary)
      : map_(map),
        options_(options),
        delta_eps_(delta_eps),
        budget_(budget),
        summary_(*summary),
        local_(map),
        region_(local_, options.max_observations_per_landmark) {}

  rba::LocalMap& local() { return local_; }

  // Solves from these active frames on, and writes the outcome to the map.
  void run(const std::vector<std::int32_t>& frames) {
    for (const std::int32_t frame : frames) region_.activate(frame);
    if (region_.active().empty()) return;
    while (solve_once()) {
      const std::vector<std::int32_t> moved = moved_by(delta_eps_);
      if (moved.empty() || options_.everything_active) break;
      if (summary_.work >= budget_ || region_.active().size() + moved.size() > kMostActiveFrames) break;
      for (const std::int32_t frame : moved) region_.activate(frame);
    }
    write();
  }

 private:
  // False if the solve failed: what it tried is forgotten.
  bool solve_once() {
    rba::Problem problem;
    region_.build(&problem);
    rba::SolverOptions solver;
    solver.max_iterations = options_.max_iterations;
    solver.huber = options_.huber_px;
    if (options_.everything_active) {
      solver.max_iterations = kFullIterations;
      solver.relative_decrease = kFullRelativeDecrease;
    }
    rba::CovarianceRequest covariance;
    if (!options_.everything_active) {
      covariance.wanted = region_.far_from_boundary(problem, kCovarianceDistance);
      covariance.previous = region_.previous_columns();
    }
    const rba::SolverReport report = rba::solve(&problem, solver, &covariance);
    ++summary_.solves;
    summary_.iterations += static_cast<std::uint32_t>(report.iterations);
    summary_.work += report.work;
    if (report.failed) {
      ++summary_.failures;
      return false;
    }
    if (summary_.solves == 1) summary_.cost_before = report.cost_before;
    summary_.cost_after = report.cost_after;
    region_.take(problem);
    for (std::size_t c = 0; c < covariance.covariances.size(); ++c) {
      if (covariance.covariances[c].isZero(0)) continue;
      rba::LocalEdge& edge = local_.edges[region_.edge_of_column(static_cast<std::int32_t>(c))];
      edge.covariance = covariance.covariances[c];
      edge.with_previous = covariance.with_previous[c];
      edge.previous = covariance.previous[c] < 0 ? -1 : region_.edge_of_column(covariance.previous[c]);
      edge.covariance_changed = true;
    }
    errors_ = rba::mean_errors(problem, local_.frames.size());
    solved_ = region_.active().size();
    return true;
  }

  // Static frames whose mean error is not what it was when they were last solved for.
  std::vector<std::int32_t> moved_by(double eps) const {
    std::vector<std::int32_t> moved;
    for (std::size_t f = 0; f < errors_.size(); ++f) {
      const auto frame = static_cast<std::int32_t>(f);
      if (errors_[f].terms == 0 || region_.is_active(frame)) continue;
      const FrameHot& record = *local_.frames[f].hot;
      if (record.mean_error < 0 || record.error_terms != errors_[f].terms ||
          std::abs(record.mean_error - errors_[f].mean()) > eps)
        moved.push_back(frame);
    }
    return moved;
  }

  void write() {
    MapState& state = map_.state();
    for (const std::int32_t frame : region_.active()) state.pending.erase(local_.frames[frame].id);
    summary_.active_frames += static_cast<std::uint32_t>(region_.active().size());
    if (solved_ == 0) return;
    if (!options_.everything_active)
      for (const std::int32_t frame : moved_by(options_.idle_delta_eps)) state.pending.insert(local_.frames[frame].id);

    for (std::size_t k = 0; k < solved_; ++k) {
      const std::int32_t frame = region_.active()[k];
      const auto mean = static_cast<float>(errors_[frame].mean());
      const FrameHot& record = *local_.frames[frame].hot;
      if (record.mean_error == mean && record.error_terms == errors_[frame].terms) continue;
      FrameHot& hot = map_.edit_hot(local_.frames[frame].id);
      hot.mean_error = mean;
      hot.error_terms = errors_[frame].terms;
    }
    for (const rba::LocalLandmark& landmark : local_.landmarks) {
      if (!landmark.changed) continue;
      Landmark& stored = map_.edit_hot(landmark.id.base).landmarks[landmark.id.slot];
      stored.abr = landmark.abr;
      stored.depth_prior = landmark.depth_prior;
    }
    for (const rba::LocalEdge& edge : local_.edges) {
      if (!edge.changed && !edge.covariance_changed) continue;
      Edge& stored = *map_.edit_hot(edge.id.frame).edge(edge.id);
      stored.T_ab = edge.T_ab;
      stored.covariance = edge.covariance;
      if (edge.previous >= 0)
        stored.correlation_with_previous =
            to_correlation(edge.with_previous, edge.covariance, local_.edges[edge.previous].covariance);
      // A closure keeps what its verification measured: a free loop edge fits whatever it is given.
      if (stored.support >= kMinSupport && stored.kind == EdgeKind::kOdometry) {
        stored.prior_T_ab = stored.T_ab;
        stored.prior_covariance = stored.covariance;
      }
    }
  }

  Map& map_;
  const RbaOptions& options_;
  double delta_eps_;
  std::uint64_t budget_;
  RbaSummary& summary_;
  rba::LocalMap local_;
  rba::Region region_;
  std::vector<rba::MeanError> errors_;  // by local frame, after the last solve that succeeded
  std::size_t solved_ = 0;              // active frames of that solve
};

std::vector<std::int32_t> every_frame(Map& map, rba::LocalMap& local) {
  std::vector<std::int32_t> frames;
  for (const Session& session : map.sessions()) {
    if (session.frames == 0) continue;
    for (std::uint64_t index = session.first; index <= session.last; ++index) {
      const std::int32_t frame = local.frame({session.number, static_cast<std::uint32_t>(index)});
      if (frame >= 0) frames.push_back(frame);
    }
  }
  return frames;
}

}  // namespace

RbaSummary relax(Map& map, std::span<const FrameId> seeds, const RbaOptions& options) {
  RbaSummary summary;
  Relaxation relaxation(map, options, options.delta_eps, options.budget, &summary);
  std::vector<std::int32_t> frames;
  if (options.everything_active) {
    frames = every_frame(map, relaxation.local());
  } else {
    for (const FrameId seed : seeds) {
      const std::int32_t frame = relaxation.local().frame(seed);
      if (frame < 0) continue;
      const auto window = relaxation.local().nearest(frame, options.window);
      frames.insert(frames.end(), window.begin(), window.end());
    }
  }
  relaxation.run(frames);
  return summary;
}

RbaSummary relax_pending(Map& map, std::uint64_t budget, const RbaOptions& options) {
  RbaSummary summary;
  while (summary.work < budget && !map.state().pending.empty()) {
    const FrameId first = map.state().pending.first();
    map.state().pending.erase(first);
    Relaxation relaxation(map, options, options.idle_delta_eps, budget, &summary);
    const std::int32_t frame = relaxation.local().frame(first);
    if (frame >= 0) relaxation.run(relaxation.local().nearest(frame, options.window));
  }
  return summary;
}

}  // namespace relmap
