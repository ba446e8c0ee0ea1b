#include "server/rba/rba.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/rba/levenberg_marquardt.h"
#include "server/rba/local_map.h"
#include "server/rba/mean_errors.h"
#include "server/rba/region.h"
#include "storage/graph/precision.h"

namespace relmap::rba {

namespace {

// An edge's marginal covariance is taken only if at least this many edges separate it from every static frame
// (docs/method.md, 3).
constexpr std::uint32_t kCovarianceDistance = 5;
// Keeps the reduced system dense. A ripple that would reach further goes on in idle time, from where it stopped.
constexpr std::size_t kMaxActiveFrames = 64;
// A window is filled with the nearest frames that are not fixed, among this many windows' worth of frames.
constexpr std::uint32_t kWindowsLooked = 3;
constexpr int kFullIterations = 100;
constexpr double kFullRelativeDecrease = 1e-12;

}  // namespace

struct Relaxer::Impl {
  Impl(storage::Map& edited, const RbaOptions& how)
      : map(edited), options(how), local(edited), region(local, how.own_step) {}

  // How far a relaxation goes.
  struct Extent {
    double delta_eps;      // in sigmas: a frame whose mean error changed by more is activated
    std::uint64_t budget;  // linearised observations
    bool full = false;
  };

  // Fixed frames stand still unless moves_fixed; frames of frozen sessions always do.
  bool stands_still(std::int32_t frame) {
    return local.is_frozen(frame) || (!moves_fixed && local.frame_is_fixed(frame));
  }

  void begin() {
    local.clear();
    region.clear();
    solved = 0;
    moves_fixed = false;
  }

  // Adds the frames nearest to this one, except those that stand still, to the seeds.
  void add_window(std::int32_t frame) {
    near.clear();
    local.nearest(frame, kWindowsLooked * options.window, &near);
    std::uint32_t left = options.window;
    for (std::size_t k = 0; k < near.size() && left > 0; ++k) {
      if (stands_still(near[k])) continue;
      seeds.push_back(near[k]);
      --left;
    }
  }

  // Activates these frames, solves and ripples, and writes the outcome to the map.
  void run(const std::vector<std::int32_t>& frames, const Extent& extent, RbaSummary* summary) {
    region.hold_fixed(!extent.full && !moves_fixed);
    for (const std::int32_t frame : frames)
      if (!local.is_frozen(frame)) region.activate(frame);
    if (region.active().empty()) return;
    while (solve_once(extent, summary)) {
      if (extent.full) break;
      find_moved(extent.delta_eps);
      if (moved.empty()) break;
      if (summary->work >= extent.budget || region.active().size() + moved.size() > kMaxActiveFrames) break;
      for (const std::int32_t frame : moved) region.activate(frame);
    }
    summary->active_frames += static_cast<std::uint32_t>(region.active().size());
    write(extent);
  }

  // False if the solve failed; its result is then discarded.
  bool solve_once(const Extent& extent, RbaSummary* summary) {
    region.build(&problem);
    rba::SolverOptions how;
    how.max_iterations = options.max_iterations;
    how.huber = options.huber_px;
    covariance.wanted.clear();
    if (extent.full) {
      how.max_iterations = kFullIterations;
      how.relative_decrease = kFullRelativeDecrease;
    } else {
      region.far_from_boundary(problem, kCovarianceDistance, &covariance.wanted);
      region.previous_columns(&covariance.previous);
    }
    const rba::SolverReport report = solver.solve(&problem, how, &covariance);
    ++summary->solves;
    summary->iterations += static_cast<std::uint32_t>(report.iterations);
    summary->work += report.work;
    if (report.failed) {
      ++summary->failures;
      return false;
    }
    if (summary->solves == 1) summary->cost_before = report.cost_before;
    summary->cost_after = report.cost_after;
    region.take(problem);
    take_covariances();
    rba::mean_errors(problem, solver.poses(), local.frames.size(), &errors);
    solved = region.active().size();
    return true;
  }

  void take_covariances() {
    for (std::size_t c = 0; c < covariance.covariances.size(); ++c) {
      if (covariance.covariances[c].isZero(0)) continue;
      rba::EdgeEstimate& edge = local.estimate(region.edge_of_column(static_cast<std::int32_t>(c)));
      edge.covariance = covariance.covariances[c];
      edge.with_previous = covariance.with_previous[c];
      edge.previous = covariance.previous[c] < 0 ? -1 : region.edge_of_column(covariance.previous[c]);
      edge.covariance_changed = true;
    }
  }

  // Sets `moved` to the static frames whose mean error differs by more than eps from that of their last solve, except
  // those that stand still.
  void find_moved(double eps) {
    moved.clear();
    for (std::size_t f = 0; f < errors.size(); ++f) {
      const auto frame = static_cast<std::int32_t>(f);
      if (errors[f].terms == 0 || region.is_active(frame)) continue;
      const storage::FrameHot& record = *local.frames[f].hot;
      const bool as_it_was = record.mean_error >= 0 && record.error_terms == errors[f].terms &&
                             std::abs(record.mean_error - errors[f].mean()) <= eps;
      if (!as_it_was && !stands_still(frame)) moved.push_back(frame);
    }
  }

  void write(const Extent& extent) {
    storage::MapState& state = map.state();
    for (const std::int32_t frame : region.active()) state.pending.erase(local.frames[frame].id);
    if (solved == 0) return;
    if (!extent.full) {
      find_moved(options.idle_delta_eps);
      for (const std::int32_t frame : moved) state.pending.insert(local.frames[frame].id);
    }
    for (std::size_t k = 0; k < solved; ++k) {
      const std::int32_t frame = region.active()[k];
      const auto mean = static_cast<float>(errors[frame].mean());
      const storage::FrameHot& record = *local.frames[frame].hot;
      if (record.mean_error == mean && record.error_terms == errors[frame].terms) continue;
      storage::FrameHot& hot = map.edit_hot(local.frames[frame].id);
      hot.mean_error = mean;
      hot.error_terms = errors[frame].terms;
    }
    for (const rba::LocalLandmark& landmark : local.landmarks) {
      if (!landmark.changed) continue;
      storage::Landmark& stored = map.edit_hot(landmark.id.base).landmarks[landmark.id.slot];
      stored.abr = landmark.abr;
      stored.depth_prior = landmark.depth_prior;
    }
    for (std::size_t e = 0; e < local.estimates.size(); ++e) {
      const rba::EdgeEstimate& edge = local.estimates[e];
      if (!edge.changed && !edge.covariance_changed) continue;
      const EdgeId id = local.edges[e].id;
      storage::Edge& stored = *map.edit_hot(id.frame).edge(id);
      stored.T_ab = edge.T_ab;
      if (edge.changed) map.note_moved(id.frame);
      stored.covariance = edge.covariance;
      if (edge.previous >= 0)
        stored.correlation_with_previous =
            storage::to_correlation(edge.with_previous, edge.covariance, local.estimates[edge.previous].covariance);
    }
  }

  storage::Map& map;
  const RbaOptions options;
  rba::LocalMap local;
  rba::Region region;
  rba::Problem problem;
  rba::LevenbergMarquardt solver;
  rba::CovarianceRequest covariance;
  std::vector<rba::MeanError> errors;  // by local frame, after the last solve that succeeded
  std::size_t solved = 0;              // number of active frames of that solve
  bool moves_fixed = false;
  std::vector<std::int32_t> seeds, moved, near;
};

Relaxer::Relaxer(storage::Map& map, const RbaOptions& options) : impl_(std::make_unique<Impl>(map, options)) {}
Relaxer::~Relaxer() = default;

void Relaxer::freeze(SessionNumber session, bool stands_still) { impl_->local.freeze(session, stands_still); }

RbaSummary Relaxer::relax(std::span<const FrameId> seeds, bool move_fixed) {
  RbaSummary summary;
  if (impl_->options.window == 0) return summary;
  impl_->begin();
  impl_->moves_fixed = move_fixed;
  impl_->seeds.clear();
  for (const FrameId seed : seeds) {
    const std::int32_t frame = impl_->local.frame(seed);
    if (frame >= 0) impl_->add_window(frame);
  }
  impl_->run(impl_->seeds, {impl_->options.delta_eps, impl_->options.budget}, &summary);
  impl_->begin();  // releases the map's frames
  return summary;
}

RbaSummary Relaxer::relax_pending(std::uint64_t budget) {
  RbaSummary summary;
  storage::FrameSet& pending = impl_->map.state().pending;
  while (summary.work < budget && !pending.empty()) {
    const FrameId first = pending.first();
    pending.erase(first);
    impl_->begin();
    const std::int32_t frame = impl_->local.frame(first);
    if (frame < 0) continue;
    impl_->seeds.clear();
    impl_->add_window(frame);
    impl_->run(impl_->seeds, {impl_->options.idle_delta_eps, budget}, &summary);
  }
  impl_->begin();
  return summary;
}

RbaSummary Relaxer::relax_fully() {
  RbaSummary summary;
  impl_->begin();
  impl_->seeds.clear();
  impl_->map.visit_sessions(0, [this](const storage::Session& session) {
    for (std::uint64_t index = session.first; session.frames > 0 && index <= session.last; ++index) {
      const std::int32_t frame = impl_->local.frame({session.number, static_cast<std::uint32_t>(index)});
      if (frame >= 0) impl_->seeds.push_back(frame);
    }
    return true;
  });
  impl_->run(impl_->seeds, {0, std::numeric_limits<std::uint64_t>::max(), true}, &summary);
  impl_->begin();
  return summary;
}

}  // namespace relmap::rba
