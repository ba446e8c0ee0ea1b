// Relative bundle adjustment: the cost of a keyframe, and the accuracy of the adaptive solution against the full one.
#include <cstdlib>
#include <memory>

#include "server/rba/rba.h"
#include "tools/bench/rba_scenarios.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

struct RbaBenchOptions {
  std::string scenario = "figure8";
  std::uint32_t frames = 0;  // 0: the scenario's
  std::uint32_t laps = 1000;
  std::uint64_t memory_budget_mb = 256;
  std::string data;
  int seeds = 0;  // 0: the scenario's
  std::uint32_t window = rba::RbaOptions().window;
  std::uint32_t observations = 45;  // of a frame
  bool full = true;
  std::string picture;
};

void run(RbaBenchOptions options, Report& report) {
  if (options.seeds == 0) options.seeds = options.scenario == "figure8" ? 20 : 3;
  // The world of 45 observations a frame.
  const double births = Figure8Options().births * options.observations / 45;
  const Figure8Options figure8{options.window, options.seeds, births, options.full, options.picture};
  if (options.scenario == "figure8") return run_figure8(figure8, report);
  if (options.scenario == "regions") return run_regions(figure8, report);
  if (options.scenario == "edges")
    return run_edges({options.window, options.seeds, options.full, options.picture}, report);
  const char* recorded = std::getenv("RELMAP_DATA");
  const EuclideanOptions euclidean{options.window, options.seeds, births,
                                   options.data.empty() && recorded ? recorded : options.data, options.picture};
  if (options.scenario == "euclidean") return run_euclidean(euclidean, report);
  if (options.scenario == "real") return run_real(euclidean, report);
  if (options.scenario == "lift") return run_lift({options.window, options.seeds, options.picture}, report);
  ScaleOptions scale{options.frames,           options.laps, options.window, options.seeds,
                     options.memory_budget_mb, options.data, options.picture};
  const auto usually = [&](std::uint32_t frames) {
    if (scale.frames == 0) scale.frames = frames;
  };
  if (options.scenario == "loop") {
    usually(500);
    run_loop(scale, report);
  } else if (options.scenario == "laps") {
    usually(100);
    run_laps(scale, report);
  } else {
    usually(1'000'000);
    run_exploration(scale, report);
  }
}

}  // namespace

Run declare_rba(CLI::App& app) {
  const auto options = std::make_shared<RbaBenchOptions>();
  app.add_option("--scenario", options->scenario,
                 "figure8, regions, edges, euclidean, loop, laps, exploration, lift or real")
      ->check(
          CLI::IsMember({"figure8", "regions", "edges", "euclidean", "loop", "laps", "exploration", "lift", "real"}))
      ->capture_default_str();
  app.add_option("--frames", options->frames,
                 "Frames of the loop (default 500), of a lap (100), or of the exploration (1,000,000); figure8 has 288")
      ->check(CLI::Range(50U, 100'000'000U));
  app.add_option("--laps", options->laps, "Number of laps (laps)")
      ->check(CLI::Range(3U, 1'000'000U))
      ->capture_default_str();
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "Memory budget in MiB (exploration)")
      ->capture_default_str();
  app.add_option(
      "--data", options->data,
      "Folder of the map (exploration; default: a temporary one), or of the data sets (real; default: $RELMAP_DATA)");
  app.add_option("--picture", options->picture,
                 "FILE.svg or .png: time by keyframe (figure8), error by region (regions) or spacing (edges), "
                 "residuals (euclidean), "
                 "active frames (loop), time by lap (laps), error by keyframe (lift)");
  app.add_option("--seeds", options->seeds, "Noise seeds 1..N (figure8: 20; others: 3)")->check(CLI::Range(1, 1000));
  app.add_option("--window", options->window, "Frames that a new one activates")->capture_default_str();
  app.add_option("--observations", options->observations,
                 "Observations of a frame, about (figure8, regions, euclidean)")
      ->check(CLI::Range(20U, 500U))
      ->capture_default_str();
  app.add_flag("!--no-full", options->full, "Do not compute the full solution (figure8, edges)");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
