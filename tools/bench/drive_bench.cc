// relmap-bench drive: the map of a recording, in the folder of a daemon that has stopped, against truth.
#include <cmath>
#include <memory>
#include <string>

#include "storage/map/map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tests/support/drive_evaluation.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

struct DriveOptions {
  std::string data, before, truth;
};

// The first session of the map in `folder`.
testing::DriveEvaluation evaluate_folder(const std::string& folder, const testing::DriveTruth& truth) {
  auto engine = storage::open_rocksdb(folder, {}).or_throw();
  const std::uint64_t epoch = engine->acquire().or_throw();
  const auto map =
      storage::Map::open(engine, epoch, std::make_shared<storage::Budget>(std::size_t{1} << 30)).or_throw();
  const auto view = map->publish();
  const auto sessions = view->sessions();
  if (sessions.empty()) throw StatusError(Status(Reason::EMPTY_MAP, folder + " holds no session"));
  return testing::evaluate_drive(*view, sessions.front().number, truth);
}

void run(const DriveOptions& options, Report& report) {
  const testing::DriveTruth truth = testing::read_truth(options.truth).or_throw();
  const testing::DriveEvaluation after = evaluate_folder(options.data, truth);
  report.add("keyframes", after.keyframes, "keyframes in the map");
  report.add("doubled", after.keyframes_doubled, "keyframes that are in the map twice");
  report.add("loop_closures_right", after.closures_right, "accepted closures within 0.5 m and 10 degrees of truth");
  report.add("loop_closures_wrong", after.closures_wrong, "accepted closures beyond that");
  report.add("loop_edges", after.loop_edges, "closures that carry an edge of the graph");
  report.add("revisits", after.revisits, "keyframes that come back to within 1 m and 30 degrees of an earlier one");
  report.add("revisits_bound", after.revisits_bound, "of them, with 20 observations of landmarks from before");
  if (!options.before.empty()) {
    const testing::DriveEvaluation before = evaluate_folder(options.before, truth);
    report.add("registration_error_before_m", before.registration_error_m, "mean over all roots, closures off");
    report.add("registration_error_after_m", after.registration_error_m, "the same, with closures");
    report.add("revisit_error_before_m", before.revisit_error_m, "mean error of revisiting positions, closures off");
    report.add("revisit_error_after_m", after.revisit_error_m, "the same, with closures");
  } else {
    report.add("registration_error_m", after.registration_error_m, "mean over all roots");
    report.add("revisit_error_m", after.revisit_error_m, "mean error of revisiting positions");
  }
  report.add("revisit_error_max_m", after.revisit_error_max_m, "largest error of a revisiting position");
}

}  // namespace

Run declare_drive(CLI::App& app) {
  const auto options = std::make_shared<DriveOptions>();
  app.add_option("--data", options->data, "data folder of a stopped relmapd")->required();
  app.add_option("--before", options->before, "data folder of the same recording mapped without closures");
  app.add_option("--truth", options->truth, "folder with poses.txt and times.txt of the recording")->required();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
