#include "tests/support/simulated_drive.h"
#include "tools/bench/plot.h"
#include "tools/bench/rba_measures.h"
#include "tools/bench/rba_scenarios.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kEdgesLap = 200, kEdgesFrames = 300;  // half of the circuit is driven twice
// A closure becomes a loop edge if more edges than this lie between its ends. 0: every closure; the last value: only
// where there is no path.
constexpr std::uint32_t kSpacings[] = {0, 4, 8, 16, 24, 30};

// The edges of the graph that need a prior, since they have too few observations.
std::uint32_t weak_edges(testing::SimulatedDrive& drive) {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < drive.driven(); ++i)
    for (const storage::Edge& edge : drive.map().hot(drive.frame(i))->edges)
      count += edge.in_graph() && edge.prior_active;
  return count;
}

std::uint32_t loop_edges(testing::SimulatedDrive& drive) {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < drive.driven(); ++i)
    for (const storage::Edge& edge : drive.map().hot(drive.frame(i))->edges)
      count += edge.in_graph() && edge.kind == storage::EdgeKind::kLoop;
  return count;
}

}  // namespace

void run_edges(const EdgesOptions& options, Report& report) {
  std::vector<double> spacings, edges, weak, errors, full_errors, revisit, update_us, loop_update_us, active;
  for (const std::uint32_t spacing : kSpacings) {
    double error = 0, full = 0, at_revisits = 0, carried = 0, held = 0;
    std::vector<double> us, loop_us, frames;
    for (int seed = 1; seed <= options.seeds; ++seed) {
      sim::PointsWorldOptions world;
      world.frames_per_lap = kEdgesLap;
      world.frames = kEdgesFrames;
      world.noise_seed = static_cast<std::uint64_t>(seed);
      testing::SimulatedDrive drive(world, with_window(options.window), {.loop_edge_spacing = spacing});
      drive.drive();
      for (std::uint32_t i = kEdgesLap; i < kEdgesFrames; ++i) {
        const testing::DriveStep& step = drive.steps()[i];
        (step.loop_edge ? loop_us : us).push_back(1e6 * step.apply_seconds);
        frames.push_back(step.active_frames);
      }
      carried += loop_edges(drive);
      held += weak_edges(drive);
      error += drive.registration_error().mean_m;
      at_revisits += drive.revisit_error().mean_m;
      if (!options.full) continue;
      drive.relax_fully();
      full += drive.registration_error().mean_m;
    }
    const double seeds = options.seeds;
    spacings.push_back(spacing);
    edges.push_back(carried / seeds);
    weak.push_back(held / seeds);
    errors.push_back(error);
    full_errors.push_back(full);
    revisit.push_back(at_revisits / seeds);
    update_us.push_back(quantile(us, 0.5));
    loop_update_us.push_back(quantile(loop_us, 0.5));
    active.push_back(mean(frames));
  }
  report.add("seeds", options.seeds, "");
  report.add("window", options.window, "frames that a new one activates");
  report.add("frames", kEdgesFrames, "of a circuit of two thirds as many");
  report.add("loop_edge_spacing", spacings,
             "more edges than this between the ends of a loop edge; 0: every closure is one, 30: one whose ends are "
             "out of reach");
  report.add("loop_edges", edges, "of the graph, a seed");
  report.add("edges_with_prior", weak, "that observations alone do not hold, a seed");
  report.add("registration_error_m", errors, "sum over seeds");
  if (options.full) report.add("registration_error_full_m", full_errors, "everything active, to convergence");
  report.add("revisit_error_m", revisit, "of a revisiting frame to the nearest of the first lap, mean");
  report.add("update_p50_us", update_us, "second lap, keyframes without a new loop edge, all that the map does");
  report.add("loop_update_p50_us", loop_update_us, "with one");
  report.add("active_mean", active, "frames, second lap");
  std::vector<Curve> curves{{"adaptive", edges, errors}};
  if (options.full) curves.push_back({"full", edges, full_errors});
  save_plot(
      {"Registration error by the number of loop edges", "loop edges", "metres, sum over seeds", false, false, curves},
      options.picture);
}

}  // namespace relmap::bench
