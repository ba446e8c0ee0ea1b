// relmap-bench capture: the processor time that a live stereo camera takes, from the bus to a recording and to tracked
// pairs, and the number of pairs lost. The camera is simulated by a separate process, which is not counted.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/simulated_recording.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

struct CaptureOptions {
  std::uint64_t pairs = 200;
  double rate = 20;
};

struct Cost {
  double pairs = 0;        // that the program recorded or tracked
  double cpu_s = 0;        // processor time of the program
  double lost = 0;         // pairs lost on the bus or dropped by the program
  nlohmann::json summary;  // what the program printed
};

class CaptureBench {
 public:
  explicit CaptureBench(const CaptureOptions& options) : options_(options) {
    testing::record_simulation(folder_ / "drive", {"--seed", "5", "--pairs", "60", "--laps", "0.5", "--step", "0.25"});
    std::filesystem::create_directories(folder_ / "cameras/12345678");
    std::filesystem::copy_file(folder_ / "drive/calib.txt", folder_ / "cameras/12345678/calib.txt");
  }

  // Pairs of 640 x 480 x 2 are received, stamped, checksummed and written to a file.
  Cost record(std::uint64_t pairs) {
    Cost cost = at_camera({}, {testing::built_program("relmap-camera"), "--cameras", folder_ / "cameras", "--json",
                               "--quiet", "record", file("raw"), "--frames", std::to_string(pairs)});
    cost.pairs = cost.summary.at("frames");
    cost.lost += cost.summary.at("lost").get<double>() + cost.summary.at("dropped").get<double>();
    return cost;
  }

  // Pairs of a street, 512 x 384 x 2, are received, separated and tracked, and keyframes are described.
  Cost track(std::uint64_t pairs) {
    Cost cost = at_camera({"--drive", folder_ / "drive", "--pairs", std::to_string(pairs)},
                          {testing::built_program("relmap-frontend"), "--source", "iidc", "--cameras",
                           folder_ / "cameras", "--robot", "bench", "--out", file("keyframes"), "--json", "--quiet"});
    cost.pairs = cost.summary.at("tracked");
    cost.lost += cost.summary.at("camera").at("lost").get<double>() + cost.summary.at("dropped").get<double>();
    return cost;
  }

 private:
  std::string file(const std::string& ending) { return folder_ / (std::to_string(++runs_) + "." + ending); }

  Cost at_camera(std::vector<std::string> camera, const std::vector<std::string>& command) {
    const std::string output = file("out"), errors = file("err"), report = file("json");
    std::vector<std::string> all{testing::built_program("relmap-simulated-camera"),
                                 "--rate",
                                 std::to_string(options_.rate),
                                 "--output",
                                 output,
                                 "--errors",
                                 errors,
                                 "--report",
                                 report};
    all.insert(all.end(), camera.begin(), camera.end());
    all.emplace_back("--");
    all.insert(all.end(), command.begin(), command.end());
    const testing::Finished done = testing::run_program(all, std::chrono::hours(1));
    if (done.exit_code != 0) throw std::runtime_error(done.standard_error);
    const auto said = nlohmann::json::parse(testing::read_text(report));
    const int code = said.at("exit_code");
    if (code != 0 && code != 4)  // 4: interrupted
      throw std::runtime_error(command.front() + ": " + testing::read_text(errors));
    return {0, said.at("cpu_s"), said.at("lost"), nlohmann::json::parse(testing::read_text(output))};
  }

  const CaptureOptions options_;
  const storage::TemporaryFolder folder_;
  int runs_ = 0;
};

// The cost of a short run is subtracted, so that starting the program does not count.
double ms_per_pair(const Cost& all, const Cost& start) {
  return 1e3 * (all.cpu_s - start.cpu_s) / (all.pairs - start.pairs);
}

void run(const CaptureOptions& options, Report& report) {
  CaptureBench bench(options);
  const std::uint64_t few = 20;
  const Cost recorded_few = bench.record(few), recorded = bench.record(few + options.pairs);
  const Cost tracked_few = bench.track(few), tracked = bench.track(few + options.pairs);
  const double record_ms = ms_per_pair(recorded, recorded_few), track_ms = ms_per_pair(tracked, tracked_few);
  report.add("rate_hz", options.rate, "of the camera");
  report.add("record_pairs", recorded.pairs, "of 640 x 480 x 2, grey");
  report.add("record_cpu_ms_per_pair", record_ms, "received, stamped, checksummed, written: relmap-camera record");
  report.add("record_core_percent", record_ms * options.rate / 10, "of a core, at that rate");
  report.add("record_lost_pairs", recorded_few.lost + recorded.lost, "on the bus, by the camera, for want of a disk");
  report.add("track_pairs", tracked.pairs, "of 512 x 384 x 2, a street");
  report.add("track_cpu_ms_per_pair", track_ms, "received, taken apart, tracked, keyframes described: relmap-frontend");
  report.add("track_core_percent", track_ms * options.rate / 10, "of a core, at that rate");
  report.add("track_lost_pairs", tracked_few.lost + tracked.lost, "on the bus, by the camera, for want of a processor");
  report.add("tracked_p50_ms", tracked.summary.at("tracked_p50_ms").get<double>(),
             "from a frame's capture until it is tracked");
  report.add("tracked_p99_ms", tracked.summary.at("tracked_p99_ms").get<double>(), "");
}

}  // namespace

Run declare_capture(CLI::App& app) {
  const auto options = std::make_shared<CaptureOptions>();
  app.add_option("--pairs", options->pairs, "number of pairs for each program, not counting 20 for its start")
      ->check(CLI::Range(20, 1000000))
      ->capture_default_str();
  app.add_option("--rate", options->rate, "pairs a second")->check(CLI::Range(1.0, 48.0))->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
