// Relative bundle adjustment: what a keyframe costs, and how near the adaptive solution comes to the full one.
#include <chrono>
#include <memory>

#include "server/rba/levenberg_marquardt.h"
#include "server/rba/normal_equations.h"
#include "server/rba/problem_samples.h"
#include "tests/simulated_drive.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

struct Options {
  int seeds = 3;
  std::uint32_t window = RbaOptions().window;
  double births = sim::figure8_options(1).births;
  bool full = true;
};

// Mean time of a call, microseconds.
template <typename Call>
double time_of(int repeats, const Call& call) {
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < repeats; ++k) call();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count() / repeats;
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
  rba::NormalEquations equations(problem);
  report.add("kernel_assemble_us", time_of(200, [&] { equations.assemble(problem, poses, 2, 1e-6); }),
             "linearise and reduce, one iteration");
  report.add("kernel_measurements", static_cast<double>(equations.observations()), "in that problem");
  report.add("kernel_unknowns", static_cast<double>(equations.b().size()), "of its reduced system");
  report.add("kernel_cost_us", time_of(1000, [&] { rba::true_cost(problem, poses, 2); }), "true cost, once");
  report.add("kernel_solve_us",
             time_of(50,
                     [&] {
                       rba::Problem copy = problem;
                       rba::solve(&copy, rba::SolverOptions());
                     }),
             "a whole solve from 1 cm and 0.6 deg off");
}

void run(const Options& options, Report& report) {
  std::vector<double> relax_us, closure_us, active, solves, iterations, work;
  double odometry = 0, adaptive = 0, full = 0, revisit = 0, seconds = 0;
  double failures = 0, measurements = 0;
  for (int seed = 1; seed <= options.seeds; ++seed) {
    sim::PointsWorldOptions world = sim::figure8_options(static_cast<std::uint64_t>(seed));
    world.births = options.births;
    RbaOptions rba;
    rba.window = options.window;
    SimulatedDrive drive(world, rba);
    drive.drive();
    for (std::uint32_t i = 0; i < drive.driven(); ++i) {
      const DriveStep& step = drive.steps()[i];
      measurements += static_cast<double>(drive.map().warm(drive.frame(i))->observations.size());
      (step.closure ? closure_us : relax_us).push_back(1e6 * step.relax_seconds);
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
    if (!options.full) continue;
    RbaOptions everything = rba;
    everything.everything_active = true;
    relax(drive.map(), {}, everything);
    full += drive.registration_error().mean_m;
  }
  const double seeds = options.seeds;
  report.add("seeds", seeds, "noise seeds, one world");
  report.add("keyframes", static_cast<double>(active.size()), "in all of them");
  report.add("measurements_per_keyframe", measurements / static_cast<double>(active.size()), "");
  report.add("relax_p50_us", quantile(relax_us, 0.5), "relaxation of a keyframe that closes no loop");
  report.add("relax_p95_us", quantile(relax_us, 0.95), "");
  report.add("relax_max_us", quantile(relax_us, 1), "");
  report.add("relax_mean_us", 1e6 * seconds / static_cast<double>(active.size()), "all keyframes");
  report.add("closure_p50_us", quantile(closure_us, 0.5), "of a keyframe at which a closure came into force");
  report.add("closure_max_us", quantile(closure_us, 1), "");
  report.add("active_frames_mean", mean(active), "in the widest relaxation of a keyframe");
  report.add("active_frames_max", quantile(active, 1), "");
  report.add("solves_per_keyframe", mean(solves), "");
  report.add("iterations_per_keyframe", mean(iterations), "");
  report.add("work_per_keyframe", mean(work), "linearised measurements");
  report.add("numerical_failures", failures, "");
  report.add("registration_error_odometry_m", odometry / seeds, "mean over seeds");
  report.add("registration_error_adaptive_m", adaptive / seeds, "as the map grew, no idle work");
  if (options.full) {
    report.add("registration_error_full_m", full / seeds, "everything active, to convergence");
    report.add("adaptive_over_full", adaptive / full, "");
  }
  report.add("revisit_error_mean_m", revisit / seeds, "");
  kernels(report);
}

}  // namespace

Run declare_rba(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  app.add_option("--seeds", options->seeds, "Noise seeds 1..N")->capture_default_str();
  app.add_option("--window", options->window, "Frames that a new one activates")->capture_default_str();
  app.add_option("--births", options->births, "Landmarks born in a frame")->capture_default_str();
  app.add_flag("!--no-full", options->full, "Leave out the full solution");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
