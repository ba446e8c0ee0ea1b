#include <chrono>
#include <filesystem>
#include <optional>

#include "server/ops/process.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/simulated_drive.h"
#include "tools/bench/plot.h"
#include "tools/bench/rba_measures.h"
#include "tools/bench/rba_scenarios.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kAfterClosing = 16;  // frames driven on behind the closing of a loop
constexpr std::uint32_t kMaxForFull = 1000;  // the full solution of larger ones takes minutes

sim::PointsWorldOptions circle(std::uint32_t frames_per_lap, std::uint32_t frames, int seed) {
  sim::PointsWorldOptions world;
  world.frames_per_lap = frames_per_lap;
  world.frames = frames;
  world.noise_seed = static_cast<std::uint64_t>(seed);
  return world;
}

// Microseconds of the updates in [first, end), without those at which a loop edge came.
std::vector<double> update_us(const testing::SimulatedDrive& drive, std::uint32_t first, std::uint32_t end) {
  std::vector<double> us;
  for (std::uint32_t i = first; i < end; ++i)
    if (!drive.steps()[i].loop_edge) us.push_back(1e6 * drive.steps()[i].relax_seconds);
  return us;
}

void report_updates(const std::vector<double>& us, const std::string& of_what, Report& report) {
  report.add("update_p50_us", quantile(us, 0.5), of_what);
  report.add("update_p99_us", quantile(us, 0.99), "");
}

}  // namespace

void run_loop(const ScaleOptions& options, Report& report) {
  std::vector<double> us, loop_us, loop_work, active, active_at_loop, by_step;
  double error = 0, full = 0, unsupported = 0, failures = 0;
  for (int seed = 1; seed <= options.seeds; ++seed) {
    const rba::RbaOptions rba = with_window(options.window);
    testing::SimulatedDrive drive(circle(options.frames, options.frames + kAfterClosing, seed), rba);
    drive.drive();
    by_step.clear();
    for (const testing::DriveStep& step : drive.steps()) {
      by_step.push_back(step.active_frames);
      (step.loop_edge ? loop_us : us).push_back(1e6 * step.relax_seconds);
      active.push_back(step.active_frames);
      if (step.loop_edge) {
        active_at_loop.push_back(step.active_frames);
        loop_work.push_back(static_cast<double>(step.work));
      }
      failures += step.failures;
    }
    unsupported += unsupported_edges(drive);
    if (options.frames > kMaxForFull) continue;
    error += drive.registration_error(10).mean_m;
    drive.relax_fully();
    full += drive.registration_error(10).mean_m;
  }
  report.add("active_by_step", by_step, "frames, of the last seed");
  const std::string title = "Active frames by keyframe: a loop of " + std::to_string(options.frames);
  save_plot({title, "keyframe", "active frames", false, false, {curve_by_step("adaptive region", by_step)}},
            options.picture);
  report.add("frames", options.frames, "of the loop");
  report.add("seeds", options.seeds, "");
  report.add("window", options.window, "frames that a new one activates");
  report_updates(us, "of keyframes without a new loop edge", report);
  report.add("loop_update_p50_us", quantile(loop_us, 0.5), "of keyframes with one");
  report.add("loop_update_max_us", quantile(loop_us, 1), "");
  report.add("loop_updates", static_cast<double>(loop_us.size()), "");
  report.add("active_mean", mean(active_at_loop), "frames that a loop edge's relaxation activates");
  report.add("active_max", quantile(active, 1), "frames, of any keyframe's");
  report.add("loop_work_mean", mean(loop_work), "linearised measurements, of keyframes with a loop edge");
  report.add("loop_work_max", quantile(loop_work, 1), "");
  report.add("unsupported_edges", unsupported, "with neither observations nor a prior");
  report.add("numerical_failures", failures, "");
  if (options.frames > kMaxForFull) return;
  report.add("registration_error_m", error, "sum over seeds; every tenth frame as root");
  report.add("registration_error_full_m", full, "everything active, to convergence");
}

void run_laps(const ScaleOptions& options, Report& report) {
  testing::SimulatedDrive drive(circle(options.frames, options.frames * options.laps, 1), with_window(options.window));
  drive.drive(2 * options.frames);
  const std::uint64_t landmarks_before = landmarks(drive);
  drive.drive();
  const auto second = update_us(drive, options.frames, 2 * options.frames);
  const auto last = update_us(drive, drive.driven() - options.frames, drive.driven());
  std::vector<double> active;
  for (const testing::DriveStep& step : drive.steps()) active.push_back(step.active_frames);
  report.add("frames", drive.driven(), "");
  report.add("laps", options.laps, "");
  report.add("window", options.window, "frames that a new one activates");
  report_updates(last, "of the last lap, keyframes without a new loop edge", report);
  report.add("second_lap_update_p50_us", quantile(second, 0.5), "");
  report.add("second_lap_update_p99_us", quantile(second, 0.99), "");
  std::vector<double> p50, p99, apply_p99;
  for (std::uint32_t lap = 0; lap < options.laps; ++lap) {
    const auto us = update_us(drive, lap * options.frames, (lap + 1) * options.frames);
    std::vector<double> apply_us;
    for (std::uint32_t i = lap * options.frames; i < (lap + 1) * options.frames; ++i)
      apply_us.push_back(1e6 * drive.steps()[i].apply_seconds);
    p50.push_back(quantile(us, 0.5));
    p99.push_back(quantile(us, 0.99));
    apply_p99.push_back(quantile(apply_us, 0.99));
  }
  save_plot({"Time of an update by lap: a circuit of " + std::to_string(options.frames),
             "lap",
             "us",
             false,
             false,
             {curve_by_step("median", p50), curve_by_step("99th percentile", p99)}},
            options.picture);
  report.add("update_p50_us_by_lap", p50, "");
  report.add("update_p99_us_by_lap", p99, "");
  report.add("apply_p99_us_by_lap", apply_p99, "all that the map does with a keyframe, loop edges included");
  report.add("active_mean", mean(active), "frames");
  report.add("active_max", quantile(active, 1), "");
  report.add("landmarks", static_cast<double>(landmarks(drive)), "stored");
  report.add("landmarks_after_two_laps", static_cast<double>(landmarks_before), "");
  report.add("landmarks_in_force", static_cast<double>(landmarks_in_force(drive)), "that mean no other");
  report.add("points_seen", static_cast<double>(points_seen(drive)), "of the world");
  report.add("unsupported_edges", unsupported_edges(drive), "with neither observations nor a prior");
  if (drive.driven() > kMaxForFull) return;
  report.add("registration_error_m", drive.registration_error(10).mean_m, "every tenth frame as root");
  drive.relax_fully();
  report.add("registration_error_full_m", drive.registration_error(10).mean_m, "everything active, to convergence");
}

void run_exploration(const ScaleOptions& options, Report& report) {
  std::optional<storage::TemporaryFolder> own;
  if (options.data.empty()) own.emplace();
  const auto budget = std::make_shared<storage::Budget>(options.memory_budget_mb << 20);
  storage::RocksDbOptions how;
  how.cache_bytes = budget->allowance(storage::Share::kEngine);
  const std::shared_ptr<storage::Engine> engine =
      storage::open_rocksdb(own ? *own / "map" : options.data, how).or_throw();
  const std::uint64_t epoch = engine->acquire().or_throw();
  testing::SimulatedDrive drive(circle(options.frames, options.frames, 1), with_window(options.window),
                                {.proposed = false}, storage::Map::open(engine, epoch, budget).or_throw());
  auto last_commit = std::chrono::steady_clock::now();
  while (drive.driven() < options.frames) {
    drive.drive(drive.driven() + 1);
    if (!drive.map().commit_is_due() && std::chrono::steady_clock::now() - last_commit < std::chrono::seconds(1))
      continue;
    if (Status status = drive.map().begin_commit({}); !status.ok()) throw StatusError(status);
    budget->set(storage::Share::kEngine, engine->memory_bytes());
    last_commit = std::chrono::steady_clock::now();
  }
  const std::uint32_t tenth = options.frames / 10;
  const auto first = update_us(drive, 0, tenth);
  const auto last = update_us(drive, options.frames - tenth, options.frames);
  report.add("frames", options.frames, "through the store");
  report.add("budget_mb", static_cast<double>(options.memory_budget_mb), "");
  report.add("window", options.window, "frames that a new one activates");
  report_updates(last, "of the last tenth", report);
  report.add("first_tenth_update_p50_us", quantile(first, 0.5), "");
  report.add("first_tenth_update_p99_us", quantile(first, 0.99), "");
  report.add("rss_max_mb", static_cast<double>(ops::peak_resident_bytes()) / (1 << 20), "peak resident size");
}

}  // namespace relmap::bench
