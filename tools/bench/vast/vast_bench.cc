// relmap-bench vast: a town driven by a fleet (150 km on 38 km of streets, if nothing else is said), through a daemon
// of its own.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tools/bench/subcommand.h"
#include "tools/bench/vast/vast_drive.h"
#include "tools/bench/vast/vast_judge.h"
#include "tools/bench/vast/vast_page.h"

namespace relmap::bench {

namespace {

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }
double p99(std::vector<double> values) { return quantile(std::move(values), 0.99); }
double greatest(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

// The median over the samples of a tenth of the run, by keyframes.
double of_tenth(const VastProgress& progress, const VastOptions& options, int tenth) {
  std::vector<double> updates;
  for (const VastSample& sample : progress.samples) {
    const auto at = static_cast<int>(10 * sample.frames / (options.keyframes + 1));
    if (at == tenth && sample.update_p99_us > 0) updates.push_back(sample.update_p99_us);
  }
  return median(updates);
}

void report_run(const VastProgress& progress, const VastOptions& options, const VastVerdict& verdict, Report& report) {
  const auto keyframes = static_cast<double>(verdict.keyframes);
  std::vector<double> lags;
  for (const VastSample& sample : progress.samples) lags.push_back(sample.lookup_lag_s);
  report.add("keyframes_per_s", keyframes / progress.s, "from the first push until all are relaxed and looked up");
  report.add("cpu_ms_per_keyframe", 1e3 * progress.cpu_s / keyframes, "of the daemon");
  report.add("lookup_lag_max_s", greatest(lags), "a keyframe was in the map before its lookup was done, at most");
  report.add("update_p99_first_us", of_tenth(progress, options, 0), "update, 99 %, in the first tenth of the run");
  report.add("update_p99_last_us", of_tenth(progress, options, 9), "and in the last");
  report.add("resident_mb", progress.peak_resident_mb, "of the daemon, at most");
  report.add("kills", progress.kills, "of the daemon, by signal 9");
  report.add("start_max_s", greatest(progress.starts_s), "after a kill, until it served");
  report.add("routes", static_cast<double>(progress.route_ms.size()), "found while it streamed");
  report.add("route_p50_ms", median(progress.route_ms), "over RPC, while it streamed");
  report.add("route_p99_ms", p99(progress.route_ms), "");
  report.add("routes_refused", static_cast<double>(progress.routes_refused),
             "no way was known yet, or no daemon served");
  std::vector<double> place_ms;
  for (const VastQuestion& question : progress.places) place_ms.push_back(question.ms);
  report.add("place_p50_ms", median(place_ms), "where a frame is, over RPC, while it streamed");
  report.add("place_p99_ms", p99(place_ms), "");
  report.add("places_found", static_cast<double>(progress.places_found), "of these questions");
  report.add("places_wrong", static_cast<double>(progress.places_wrong),
             "off by more than 0.5 m or 10 degrees, and three sigmas");
}

void report_map(const VastVerdict& verdict, Report& report) {
  report.add("keyframes", static_cast<double>(verdict.keyframes), "in the map");
  report.add("lost", static_cast<double>(verdict.lost), "keyframes");
  report.add("doubled", static_cast<double>(verdict.doubled), "keyframes");
  report.add("driven_km", verdict.metres / 1000, "by all robots");
  report.add("streets_km", verdict.street_metres / 1000, "in the town");
  report.add("closures_right", static_cast<double>(verdict.closures_right), "in force, within 0.5 m and 10 degrees");
  report.add("closures_vague", static_cast<double>(verdict.closures_vague),
             "in force, beyond that, as their covariance tells");
  report.add("closures_wrong", static_cast<double>(verdict.closures_wrong), "in force, beyond that and three sigmas");
  report.add("revisits", static_cast<double>(verdict.revisits), "frames where an earlier one had stood");
  report.add(
      "revisits_bound_share",
      static_cast<double>(verdict.revisits_bound) / static_cast<double>(std::max<std::uint64_t>(1, verdict.revisits)),
      "with at least 20 observations of landmarks from then");
  report.add("rides", static_cast<double>(verdict.rides), "in trains");
  report.add("rides_returned", static_cast<double>(verdict.rides_returned), "after which a known place was seen");
  report.add("rides_closed", static_cast<double>(verdict.rides_closed), "of these, known to have carried the robot");
  report.add("carried_wrongly", static_cast<double>(verdict.carried_wrongly),
             "closures in force that tell of a ride where there was none");
  report.add("step_error_p50_m", median(verdict.step_error_m), "of the robots' steps in the map, but for trains");
  report.add("step_error_p99_m", p99(verdict.step_error_m), "");
  report.add("step_error_max_m", greatest(verdict.step_error_m), "");
  report.add("own_step_error_p50_m", median(verdict.own_step_error_m), "of the same steps, by the robots' odometry");
  report.add("odometry_error_p50_m", median(verdict.odometry_error_m), "at revisits, by the robot's odometry");
  report.add("map_error_p50_m", median(verdict.map_error_m), "at revisits, through the map");
  report.add("map_error_max_m", greatest(verdict.map_error_m), "");
  report.add("disconnected", static_cast<double>(verdict.disconnected), "of the revisits measured");
  report.add("findings", static_cast<double>(verdict.findings), "of relmap-admin verify");
  report.add("disk_kb_per_keyframe",
             static_cast<double>(verdict.bytes_on_disk) / 1000 /
                 static_cast<double>(std::max<std::uint64_t>(1, verdict.keyframes)),
             "of the map's folder");
}

// Whoever drives for hours learns now that the results cannot be written.
void check_writable(const std::string& file) {
  if (!file.empty() && !std::ofstream(file, std::ios::app))
    throw StatusError(Status(Reason::IO_ERROR, file + " cannot be written"));
}

void run(VastOptions options, Report& report) {
  for (const std::string& file : {options.picture, options.page, options.edges}) check_writable(file);
  std::optional<storage::TemporaryFolder> temporary;
  if (options.folder.empty()) options.folder = temporary.emplace() / "vast";
  const VastTown town(options);
  const VastProgress progress = drive_town(town, options);
  const VastVerdict verdict = judge_town(town, options);
  for (const std::string& wrong : verdict.wrong) std::cerr << "wrong closure: " << wrong << '\n';
  for (const std::string& ride : verdict.unnoticed) std::cerr << "ride that was not noticed: " << ride << '\n';
  report_run(progress, options, verdict, report);
  report_map(verdict, report);
  if (!options.page.empty()) write_page(options, progress, verdict, report);
}

}  // namespace

Run declare_vast(CLI::App& app) {
  const auto options = std::make_shared<VastOptions>();
  app.add_option("--keyframes", options->keyframes, "of all robots together, half a metre apart")
      ->check(CLI::Range(std::uint64_t{100}, std::uint64_t{100'000'000}))
      ->capture_default_str();
  app.add_option("--robots", options->robots, "that drive at the same time")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--folder", options->folder,
                 "keeps the map and the state of the run, and goes on with a run that was interrupted "
                 "(default: a temporary folder)");
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "of the daemon")->capture_default_str();
  app.add_option("--kills", options->kills, "of the daemon, by signal 9, evenly over the run")->capture_default_str();
  app.add_option("--seed", options->seed, "of the town and the drives")->capture_default_str();
  app.add_option("--picture", options->picture, "draw the map at the end: FILE.svg or FILE.png");
  app.add_option("--page", options->page, "write a page of results, FILE.html, with the picture if that is an SVG");
  app.add_option("--edges", options->edges,
                 "write a table of the edges and closures in force with their errors at the end: FILE.tsv");
  app.add_flag("--light", options->light, "keyframes of 44 tracks and 45 features instead of 120 and 300");
  app.footer(
      "Examples:\n"
      "  relmap-bench vast --keyframes 20000 --json\n"
      "  relmap-bench vast --keyframes 300000 --robots 12 --folder vast --page vast.html --picture vast.svg\n"
      "  relmap-bench vast --folder /data/vast   # 150 km; run it again to go on where it was interrupted");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
