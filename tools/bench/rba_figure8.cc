#include <chrono>
#include <cmath>
#include <limits>

#include "server/rba/levenberg_marquardt.h"
#include "server/rba/normal_equations.h"
#include "server/rba/problem_samples.h"
#include "tests/support/simulated_drive.h"
#include "tools/bench/allocation_counter.h"
#include "tools/bench/ceres_window.h"
#include "tools/bench/euclidean_ba.h"
#include "tools/bench/plot.h"
#include "tools/bench/rba_measures.h"
#include "tools/bench/rba_scenarios.h"
#include "tools/bench/stopwatch.h"

namespace relmap::bench {

namespace {

// Samples of several seeds one after another: the median of each step over the seeds.
std::vector<double> by_step(const std::vector<double>& samples, int seeds) {
  const std::size_t steps = samples.size() / static_cast<std::size_t>(seeds);
  std::vector<double> medians;
  for (std::size_t step = 0; step < steps; ++step) {
    std::vector<double> of_step;
    for (std::size_t k = step; k < samples.size(); k += steps) of_step.push_back(samples[k]);
    medians.push_back(quantile(of_step, 0.5));
  }
  return medians;
}

// Mean time of a call, microseconds.
template <typename Call>
double time_of(int repeats, const Call& call) {
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < repeats; ++k) call();
  return microseconds_since(start) / repeats;
}

// The kernels on a problem the size of a keyframe's: eight active frames, about 600 measurements.
void kernels(Report& report) {
  rba::ProblemSample sample;
  sample.frames = 16;
  sample.first_moving = 8;
  sample.end_moving = 16;
  sample.loop = false;
  sample.landmarks_per_frame = 12;
  const rba::Problem problem = sample.make();
  std::vector<SE3> poses;
  problem.compose(&poses);
  rba::NormalEquations equations;
  equations.reset(problem);
  report.add("kernel_assemble_us", time_of(200, [&] { equations.assemble(problem, poses, 2, 1e-6); }),
             "linearise and reduce, one iteration");
  report.add("kernel_measurements", static_cast<double>(equations.observations()), "in that problem");
  report.add("kernel_unknowns", 6.0 * equations.system().size(), "of its reduced system");
  report.add("kernel_cost_us", time_of(1000, [&] { rba::true_cost(problem, poses, 2); }), "true cost, once");
  rba::LevenbergMarquardt solver;
  report.add("kernel_solve_us",
             time_of(50,
                     [&] {
                       rba::Problem copy = problem;
                       solver.solve(&copy, rba::SolverOptions());
                     }),
             "a whole solve from 1 cm and 0.6 deg off");
}

// Of the last frames' relaxations and the publication of what they changed, frame by frame, once more.
double allocations_of_an_update(testing::SimulatedDrive& drive, const rba::RbaOptions& rba) {
  constexpr std::uint32_t kFrames = 32;
  rba::Relaxer relaxer(drive.map(), rba);
  std::uint64_t before = 0;
  for (int round = 0; round < 2; ++round) {  // the first finds how much memory the second needs
    before = allocations();
    for (std::uint32_t i = drive.driven() - kFrames; i < drive.driven(); ++i) {
      const FrameId newest[] = {drive.frame(i)};
      relaxer.relax(newest);
      drive.map().publish();
    }
  }
  return static_cast<double>(allocations() - before) / kFrames;
}

// The same keyframes with sliding-window bundle adjustment: registration error in metres, and times.
double sliding_window(const testing::SimulatedDrive& drive, const rba::RbaOptions& rba, std::vector<double>* us) {
  CeresWindowOptions how;
  how.window = rba.window;
  how.max_iterations = rba.max_iterations;
  how.huber = rba.huber_px;
  how.relative_decrease = rba::SolverOptions().relative_decrease;
  CeresWindow window(drive.world().options().camera, how);
  for (std::uint32_t i = 0; i < drive.driven(); ++i) us->push_back(1e6 * window.add(drive.world().keyframe(i)));
  const std::vector<SE3> poses = window.poses();
  return sim::registration_error(drive.truth(),
                                 [&](std::size_t root) {
                                   std::vector<std::optional<SE3>> unrolled;
                                   for (const SE3& pose : poses) unrolled.emplace_back(poses[root].inverse() * pose);
                                   return unrolled;
                                 })
      .mean_m;
}

}  // namespace

void run_figure8(const Figure8Options& options, Report& report) {
  std::vector<double> relax_us, closure_us, all_us, active, solves, iterations, work, ceres_us, nees, nees_10, nees_100;
  double odometry = 0, adaptive = 0, full = 0, revisit = 0, seconds = 0, ceres = 0, rms = 0, rms_full = 0,
         rms_ceres = 0;
  double unsupported = 0, points = 0, asked = 0;
  double failures = 0, measurements = 0;
  for (int seed = 1; seed <= options.seeds; ++seed) {
    const sim::PointsWorldOptions world = figure8_world(seed, options.births);
    const rba::RbaOptions rba = with_window(options.window);
    testing::SimulatedDrive drive(world, rba);
    drive.drive();
    for (std::uint32_t i = 0; i < drive.driven(); ++i) {
      const testing::DriveStep& step = drive.steps()[i];
      measurements += static_cast<double>(drive.map().warm(drive.frame(i))->observations.size());
      (step.loop_edge ? closure_us : relax_us).push_back(1e6 * step.relax_seconds);
      all_us.push_back(1e6 * step.relax_seconds);
      active.push_back(step.active_frames);
      solves.push_back(step.solves);
      iterations.push_back(step.iterations);
      work.push_back(static_cast<double>(step.work));
      failures += step.failures;
      seconds += step.relax_seconds;
    }
    odometry += drive.odometry_registration_error().mean_m;
    adaptive += drive.registration_error().mean_m;
    revisit += drive.revisit_error().mean_m;
    rms += reprojection_rms(drive.map());
    nees.push_back(nees_of_chains(drive, 1));
    nees_10.push_back(nees_of_chains(drive, 10));
    nees_100.push_back(nees_of_chains(drive, 100));
    unsupported += unsupported_edges(drive);
    points += static_cast<double>(landmarks(drive));
    asked += allocations_of_an_update(drive, rba);
    ceres += sliding_window(drive, rba, &ceres_us);
    if (!options.full) continue;
    drive.relax_fully();
    full += drive.registration_error().mean_m;
    rms_full += reprojection_rms(drive.map());
    EuclideanBa euclidean(drive.map());
    euclidean.solve(rba.huber_px);
    rms_ceres += euclidean.rms_px();
  }
  const double seeds = options.seeds;
  report.add("seeds", seeds, "noise seeds, one world");
  report.add("keyframes", static_cast<double>(active.size()), "in all of them");
  report.add("measurements_per_keyframe", measurements / static_cast<double>(active.size()), "");
  report.add("relax_p50_us", quantile(relax_us, 0.5), "relaxation of a keyframe without a new loop edge");
  report.add("relax_p95_us", quantile(relax_us, 0.95), "");
  report.add("relax_max_us", quantile(relax_us, 1), "");
  report.add("relax_mean_us", 1e6 * seconds / static_cast<double>(active.size()), "all keyframes");
  report.add("closure_p50_us", quantile(closure_us, 0.5), "of a keyframe at which a closure became an edge");
  report.add("closure_max_us", quantile(closure_us, 1), "");
  report.add("update_p50_us", quantile(relax_us, 0.5), "relax_p50_us");
  report.add("update_p99_us", quantile(relax_us, 0.99), "of the same");
  report.add("loop_update_p50_us", quantile(closure_us, 0.5), "closure_p50_us");
  report.add("loop_update_max_us", quantile(closure_us, 1), "closure_max_us");
  report.add("ceres_local_p50_us", quantile(ceres_us, 0.5), "sliding window of as many frames, building included");
  report.add("ceres_local_p99_us", quantile(ceres_us, 0.99), "");
  report.add("ceres_over_relmap", quantile(ceres_us, 0.5) / quantile(relax_us, 0.5), "of the two medians");
  report.add("allocations_per_update", asked / options.seeds, "a relaxation and the publication of what it changed");
  report.add("active_mean", mean(active), "active_frames_mean");
  report.add("active_max", quantile(active, 1), "active_frames_max");
  report.add("window", options.window, "frames that a new one activates");
  report.add("frames", static_cast<double>(active.size()) / options.seeds, "a seed");
  report.add("landmarks", points / options.seeds, "stored, a seed");
  report.add("measurements", measurements / options.seeds, "a seed");
  report.add("rms_px", rms / options.seeds, "reprojection, per coordinate");
  if (options.full) {
    report.add("rms_px_full", rms_full / options.seeds, "everything active, to convergence");
    report.add("ceres_full_rms_px", rms_ceres / options.seeds, "in one Euclidean frame, to convergence");
  }
  report.add("nees_mean", mean(nees), "of odometry edges; 6 expected");
  report.add("nees_interval", 1.96 * deviation(nees) / std::sqrt(seeds),
             "95 %: the mean is known to so much, by the seeds");
  report.add("nees_chain_10_over_dof", mean(nees_10) / 6, "of ten edges, covariances compounded; 1 expected");
  report.add("nees_chain_100_over_dof", mean(nees_100) / 6, "of a hundred");
  report.add("unsupported_edges", unsupported, "with neither observations nor a prior");
  report.add("registration_error_m", adaptive, "sum over seeds");
  if (options.full) report.add("registration_error_full_m", full, "sum over seeds");
  report.add("registration_error_ceres_local_m", ceres, "sum over seeds; no loop closed");
  report.add("active_frames_mean", mean(active), "in the widest relaxation of a keyframe");
  report.add("active_frames_max", quantile(active, 1), "");
  report.add("solves_per_keyframe", mean(solves), "");
  report.add("iterations_per_keyframe", mean(iterations), "");
  report.add("work_per_keyframe", mean(work), "linearised measurements");
  report.add("numerical_failures", failures, "");
  report.add("registration_error_odometry_m", odometry / seeds, "mean over seeds");
  report.add("registration_error_adaptive_m", adaptive / seeds, "as the map grew, no idle work");
  if (options.full) {
    report.add("adaptive_over_full", adaptive / full, "");
  }
  report.add("revisit_error_mean_m", revisit / seeds, "");
  const std::vector<double> relmap = by_step(all_us, options.seeds), ceres_step = by_step(ceres_us, options.seeds);
  report.add("update_us_by_step", relmap, "with and without a closure; median over seeds");
  report.add("ceres_local_us_by_step", ceres_step, "");
  save_plot({"Time of an update, by keyframe: a figure eight, closed at keyframe 276",
             "keyframe",
             "microseconds",
             false,
             true,
             {curve_by_step("relmap", relmap), curve_by_step("Ceres, sliding window", ceres_step)}},
            options.picture);
  kernels(report);
}

void run_regions(const Figure8Options& options, Report& report) {
  constexpr std::uint32_t kWindows[] = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32};
  std::vector<double> windows, errors, fixed_errors, p50_us, active;
  double full = 0, odometry = 0;
  for (const std::uint32_t window : kWindows) {
    double adaptive = 0, fixed = 0;
    std::vector<double> us, frames;
    for (int seed = 1; seed <= options.seeds; ++seed) {
      const sim::PointsWorldOptions world = figure8_world(seed, options.births);
      rba::RbaOptions rba = with_window(window);
      testing::SimulatedDrive drive(world, rba);
      drive.drive();
      adaptive += drive.registration_error().mean_m;
      for (const testing::DriveStep& step : drive.steps()) {
        us.push_back(1e6 * step.relax_seconds);
        frames.push_back(step.active_frames);
      }
      if (window == kWindows[0]) {
        odometry += drive.odometry_registration_error().mean_m;
        drive.relax_fully();
        full += drive.registration_error().mean_m;
      }
      rba.delta_eps = std::numeric_limits<double>::infinity();  // the region stays what it is
      testing::SimulatedDrive narrow(world, rba);
      narrow.drive();
      fixed += narrow.registration_error().mean_m;
    }
    windows.push_back(window);
    errors.push_back(adaptive / full);
    fixed_errors.push_back(fixed / full);
    p50_us.push_back(quantile(us, 0.5));
    active.push_back(mean(frames));
  }
  report.add("seeds", options.seeds, "");
  report.add("window", windows, "frames that a new one activates");
  report.add("registration_error_over_full", errors, "adaptive regions");
  report.add("registration_error_fixed_over_full", fixed_errors, "the region is the window, whatever moves");
  report.add("active_mean", active, "frames, adaptive");
  report.add("update_p50_us", p50_us, "adaptive");
  report.add("registration_error_full_m", full, "sum over seeds");
  report.add("registration_error_odometry_over_full", odometry / full, "");
  save_plot({"Registration error by region: figure eight",
             "frames that a new one activates",
             "times the full solution's",
             true,
             false,
             {{"adaptive", windows, errors}, {"fixed", windows, fixed_errors}}},
            options.picture);
}

}  // namespace relmap::bench
