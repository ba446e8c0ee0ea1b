// Checks the figures that docs/ publish of the benchmarks, with shorter runs: counts must be equal, ratios and errors
// may be 1.5 times the published ones. The figures are read from the documents, so that these and the code cannot
// change without each other. Times are not tested, except for one ratio; `relmap-bench` measures them.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/bench_figures.h"
#include "tests/support/process.h"
#include "tests/support/published.h"
#include "tests/support/simulated_recording.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

const char* const kRba = "docs/rba.md";
const char* const kFigures = "docs/figures.md";
const char* const kFrontEnd = "docs/frontend.md";
constexpr double kFactor = 1.5;
constexpr std::chrono::seconds kPatience{200};  // with a busy machine

// expect_at_most() allows smaller values than published, expect_about() does not.
void expect_at_most(double value, double published, const std::string& what) {
  std::printf("%s: %g, published %g\n", what.c_str(), value, published);
  EXPECT_LE(value, kFactor * published) << what;
}
void expect_about(double value, double published, const std::string& what) {
  expect_at_most(value, published, what);
  EXPECT_GE(value, published / kFactor) << what;
}
// Compares by how much a ratio exceeds 1.
void expect_excess_about(double ratio, double published, const std::string& what) {
  expect_about(ratio - 1, published - 1, what + ", beyond 1");
}

// The figures of a table's row that begins with `name`, one in each of its `columns`.
std::vector<double> published_row(const std::string& document, const std::string& name, std::size_t columns) {
  std::string pattern = "\\| " + name + " \\|";
  for (std::size_t i = 0; i < columns; ++i) pattern += " ([0-9.,]+) \\|";
  return published(document, pattern);
}

TEST(PublishedFigures, HoldForTheUpdateOfAKeyframe) {
  const BenchFigures found({"rba", "--seeds", "3", "--no-full"});
  // Between seeds, the first figure varies by 0.3, and the others by 0.1 and 0.3. If the correlation of neighbouring
  // edges were left out, those of the chains would be half as large.
  EXPECT_NEAR(found["nees_mean"], published_figure(kRba, "normalised squared error is ([0-9.]+) \\+-"), 0.7);
  const auto chains = published(kRba, "and ([0-9.]+) and ([0-9.]+) of its degrees of freedom over chains");
  expect_about(found["nees_chain_10_over_dof"], chains.at(0), "chains of ten edges");
  expect_about(found["nees_chain_100_over_dof"], chains.at(1), "chains of a hundred");
  EXPECT_EQ(found["unsupported_edges"], 0);
  EXPECT_EQ(found["allocations_per_update"], 0);
  EXPECT_EQ(found["numerical_failures"], 0);
  EXPECT_NEAR(found["measurements_per_keyframe"], published_figure(kRba, "([0-9]+) measurements per keyframe\\. Eight"),
              1);
  EXPECT_NEAR(found["active_mean"], 8, 0.5) << "eight frames move";
  expect_excess_about(found["registration_error_ceres_local_m"] / found["registration_error_m"],
                      published_figure(kRba, "its registration error is ([0-9.]+) times relmap's"),
                      "error of a sliding window over relmap's");
}

TEST(PublishedFigures, HoldForTheUpdateOfAKeyframeWithManyMeasurements) {
  const BenchFigures found({"rba", "--observations", "120", "--seeds", "1", "--no-full"});
  EXPECT_NEAR(found["measurements_per_keyframe"],
              published_figure(kRba, "With ([0-9]+) measurements per keyframe \\(`--observations 120`\\)"), 1);
  const auto errors = published(kFigures,
                                "registration error, m \\| [0-9.]+ \\| [0-9.]+ \\(closes no loop\\) \\| ([0-9.]+) \\| "
                                "([0-9.]+) \\|");  // sums over five seeds
  expect_about(found["registration_error_m"], errors.at(0) / 5, "registration error, m");
  expect_excess_about(found["registration_error_ceres_local_m"] / found["registration_error_m"],
                      errors.at(1) / errors.at(0), "error of a sliding window over relmap's");
  EXPECT_EQ(found["unsupported_edges"], 0);
  EXPECT_EQ(found["allocations_per_update"], 0);
  EXPECT_EQ(found["numerical_failures"], 0);
}

TEST(PublishedFigures, HoldForTheWidthOfTheRegion) {
  const BenchFigures found({"rba", "--scenario", "regions", "--seeds", "1"});
  const auto windows = published_row(kRba, "frames that a new one activates", 8);
  const auto adaptive = published_row(kRba, "registration error over the full solution's, adaptive", 8);
  const auto fixed = published_row(kRba, "the same with the region fixed to these", 8);
  const auto active = published_row(kRba, "active frames, mean, adaptive", 8);
  const auto measured = found.series("window");
  for (std::size_t i = 0; i < windows.size(); ++i) {
    ASSERT_EQ(measured.at(i), windows[i]);
    const std::string frames = std::to_string(static_cast<int>(windows[i])) + " frames";
    const double error = found.series("registration_error_over_full").at(i);
    EXPECT_NEAR(found.series("active_mean").at(i), active[i], 0.3) << frames;
    expect_about(error, adaptive[i], "error over the full solution's, " + frames);
    // The published ratios are means over five seeds; with a wide region they are 1 for every seed.
    if (windows[i] >= 12) {
      EXPECT_NEAR(error, 1, 0.02) << frames;
    }
    if (windows[i] >= 4) continue;
    const double gain = found.series("registration_error_fixed_over_full").at(i) / error;
    EXPECT_GE(gain - 1, (fixed[i] / adaptive[i] - 1) / kFactor) << "a region that grows, from " << frames;
  }
}

TEST(PublishedFigures, HoldForClosuresThatBecomeEdges) {
  const BenchFigures found({"rba", "--scenario", "edges", "--seeds", "1", "--no-full"});
  const auto spacings = found.series("loop_edge_spacing");
  const auto columns = published(kRba,
                                 "minimum number of edges between the ends, exclusive \\| ([0-9]+) \\| ([0-9]+) \\| "
                                 "([0-9]+) \\| ([0-9]+) \\| ([0-9]+) \\| ([0-9]+): out of reach \\|");
  const auto edges = published_row(kRba, "loop edges", columns.size());
  const auto weak = published_row(kRba, "edges held by their prior alone", columns.size());
  const auto errors = published_row(kRba, "registration error, m, sum of five seeds", columns.size());
  const auto revisits = published_row(kRba, "error at revisits, mm", columns.size());
  const auto active = published_row(kRba, "frames that a keyframe activates, mean", columns.size());
  std::vector<double> measured;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto column = std::find(spacings.begin(), spacings.end(), columns[i]);
    ASSERT_NE(column, spacings.end()) << columns[i];
    const auto at = static_cast<std::size_t>(column - spacings.begin());
    const std::string beyond = ", beyond " + std::to_string(static_cast<int>(columns[i])) + " edges";
    EXPECT_EQ(found.series("loop_edges").at(at), edges[i]) << beyond;
    EXPECT_EQ(found.series("edges_with_prior").at(at), weak[i]) << beyond;
    measured.push_back(found.series("registration_error_m").at(at));
    expect_about(measured.back(), errors[i] / 5, "registration error, m" + beyond);
    expect_about(1e3 * found.series("revisit_error_m").at(at), revisits[i], "error at revisits, mm" + beyond);
    EXPECT_NEAR(found.series("active_mean").at(at), active[i], 0.3) << beyond;
  }
  const auto over_least = [](const std::vector<double>& row) { return row.front() / *std::ranges::min_element(row); };
  expect_excess_about(over_least(measured), over_least(errors), "error with an edge for every closure, over the least");
}

TEST(PublishedFigures, HoldForTheSameSolutionInOneFrame) {
  const BenchFigures found({"rba", "--scenario", "euclidean", "--seeds", "1"}, kPatience);
  const std::string number = "([0-9.e-]+)";
  const auto full = published(kRba, "full relative against full Euclidean \\| " + number + " \\| " + number + " \\|");
  expect_at_most(found["chain_full_over_euclidean_mean"], full.at(0), "full relative against Euclidean, mean");
  expect_at_most(found["chain_full_over_euclidean_max"], full.at(1), "largest");
  const auto adaptive =
      published(kRba, "adaptive, as the map grew, against full relative \\| " + number + " \\| " + number + " \\|");
  expect_about(found["chain_adaptive_over_full_mean"], adaptive.at(0), "adaptive against full relative, mean");
  expect_at_most(found["chain_adaptive_over_full_max"], adaptive.at(1), "largest");
  expect_about(found["chain_adaptive_sigmas"],
               published_figure(kRba, "the second in units of the full solution's own error \\| " + number + " \\|"),
               "in units of the full solution's own error");
  expect_about(found["chain_full_over_euclidean_mean_closed"],
               published_figure(kRba, "the Euclidean solution differ by " + number + " on average"),
               "full relative against Euclidean, with the loop closed");
  const auto euclidean = found.series("squared_error_ceres_px2");
  for (const char* const of : {"squared_error_adaptive_px2", "squared_error_full_px2"}) {
    const auto curve = found.series(of);
    ASSERT_EQ(curve.size(), euclidean.size());
    for (std::size_t i = 0; i < curve.size(); ++i) EXPECT_NEAR(curve[i] / euclidean[i], 1, 0.002) << of << " " << i;
  }
}

// Both times are medians of the same run. A disturbance may affect only one of them, but hardly in three runs.
TEST(PublishedFigures, HoldForTheTimeOfASlidingWindow) {
  const double times = published_figure(kRba, "in the same run, ([0-9.]+) times as long");
  double best = 0;
  for (int round = 0; round < 3 && best < times / kFactor; ++round)
    best = std::max(best, BenchFigures({"rba", "--seeds", "1", "--no-full"})["ceres_over_relmap"]);
  std::printf("%g times, published %g\n", best, times);
  EXPECT_GE(best, times / kFactor);
}

TEST(PublishedFigures, HoldForClosingALoopOfAnyLength) {
  std::vector<double> work;
  for (const std::string frames : {"250", "500"}) {
    const BenchFigures found({"rba", "--scenario", "loop", "--frames", frames, "--seeds", "1"});
    const auto row = published(kFigures, "\\| " + frames +
                                             " \\| [0-9]+ \\| [0-9,]+ / [0-9,]+ \\| ([0-9,]+) \\| "
                                             "([0-9.]+) / ([0-9]+) \\| ([0-9.]+) \\|");
    expect_about(found["loop_work_mean"], row.at(0), "measurements linearised at a loop edge, " + frames);
    expect_about(found["active_mean"], row.at(1), "frames activated there");
    EXPECT_LE(found["active_max"], row.at(2) + 4);
    EXPECT_LE(found["registration_error_m"] / found["registration_error_full_m"], 1.05);
    EXPECT_EQ(found["unsupported_edges"], 0);
    work.push_back(found["loop_work_mean"]);
  }
  EXPECT_NEAR(work[1] / work[0], 1, 0.3) << "a loop that is twice as long";
}

TEST(PublishedFigures, HoldForLandmarksThatDoNotGrowWithTheLaps) {
  const auto of_thousand = published(kRba, "([0-9,]+) are in force for the ([0-9,]+) points that the drive saw");
  const BenchFigures found({"rba", "--scenario", "laps", "--laps", "15"});
  expect_at_most(found["landmarks_in_force"] / found["points_seen"] - 1, of_thousand.at(0) / of_thousand.at(1) - 1,
                 "landmarks in force for each point seen, beyond 1");
  EXPECT_EQ(found["unsupported_edges"], 0);
}

TEST(PublishedFigures, HoldForThePlaceIndex) {
  const BenchFigures found({"places", "--places", "30000"});
  const auto row = published(kFigures, "\\| 100,000 \\| [^|]* \\| [^|]* \\| ([0-9]+) \\| ([0-9]+) \\|");
  expect_at_most(found["bytes_per_place"], row.at(0), "resident bytes a place");
  expect_about(found["disk_bytes_per_place"], row.at(1), "bytes a place on disk");
  EXPECT_EQ(found["restored"], 30000);
}

// A light load of the minimum length. The published figures are of a million frames.
TEST(PublishedFigures, HoldForTheMapOnDisk) {
  const BenchFigures found({"storage", "--light", "--frames", "20000", "--memory-budget-mb", "256"});
  expect_about(found["disk_bytes_per_frame"] / found["payload_zstd_bytes_per_frame"],
               published_figure(kFigures, "disk over payload after zstd \\| ([0-9.]+) \\|"), "disk over payload");
  expect_at_most(found["write_amplification"],
                 published_figure(kFigures, "bytes written over payload \\| ([0-9.]+) \\|"), "written over payload");
}

TEST(PublishedFigures, HoldForRoutesByCells) {
  const BenchFigures found({"routes", "--frames", "20000", "--queries", "200", "--live-seconds", "1"});
  EXPECT_EQ(found["mismatches"], 0);
  const auto row = published(kFigures,
                             "At 20,000 frames a route enters ([0-9]+) border frames, and cells take ([0-9]+) "
                             "bytes a frame");
  expect_at_most(found["nodes_settled_mean"], row.at(0), "border frames entered");
  expect_at_most(found["overlay_bytes_per_frame"], row.at(1), "bytes of cells a frame");
}

// A quarter of the published drive.
TEST(PublishedFigures, HoldForTheFrontEndAgainstAPlainPipeline) {
  const BenchFigures found({"frontend", "--seed", "3", "--frames", "250", "--exposure", "0.008", "--exposure-jumps",
                            "2", "--reference", "klt"});
  const auto row = published(kFrontEnd,
                             "a street, 1,000 pairs, 8 ms of exposure, jumping gain \\(below\\) \\| [0-9]+ \\| "
                             "[0-9]+ \\| ([0-9.]+) \\| ([0-9.]+) \\| ([0-9.]+) \\| ([0-9.]+) \\|");
  expect_at_most(found["drift_percent"], row.at(0), "drift, %");
  EXPECT_LE(found["drift_percent"] / found["reference_drift_percent"], kFactor * row.at(0) / row.at(1));
  EXPECT_LE(found["rotation_deg_per_100m"] / found["reference_rotation_deg_per_100m"], kFactor * row.at(2) / row.at(3));
  expect_about(found["nees_mean"], published_figure(kFrontEnd, "Mean normalised squared error of its steps ([0-9.]+) "),
               "normalised squared error of steps");
  EXPECT_EQ(found["metric_share"], 1);
  EXPECT_EQ(found["lost_pairs"], 0);
}

// A third of the published drive, without gyro. Its drift is not compared, since there are few segments in so short a
// drive.
TEST(PublishedFigures, HoldForADriveWithEveryFault) {
  const BenchFigures found({"frontend", "--faults", "all", "--seed", "4", "--frames", "220"}, kPatience);
  EXPECT_EQ(100 * found["metric_share"],
            published_figure(kFrontEnd, "steps between keyframes measured by vision \\| ([0-9.]+) %"));
  EXPECT_EQ(100 * found["topological_share"], published_figure(kFrontEnd, "steps connected \\| ([0-9.]+) %"));
  expect_about(found["nees_mean"],
               published_figure(kFrontEnd, "mean; share above chi2_6\\(0\\.999\\) \\| ([0-9.]+); [0-9.]+ % \\|"),
               "normalised squared error of steps");
}

// One drive of the published eight, with less than half of its pairs.
TEST(PublishedFigures, HoldForTenSecondsOfBlack) {
  const BenchFigures found({"frontend", "--frames", "220", "--circuit", "100", "--faults", "long_black:60", "--imu"},
                           kPatience);
  EXPECT_EQ(found["blind_steps"], 1);
  EXPECT_EQ(found["topological_share"], 1);
  const auto errors =
      published(kFrontEnd, "are wrong by at most ([0-9.]+) degrees, and their squared errors are ([0-9.]+),");
  expect_at_most(found["gyro_turn_error_deg"], errors.at(0), "rotation across, degrees");
  expect_at_most(found["blind_nees_mean"], errors.at(1), "normalised squared error of the step across");
  // A published drive sees 400 pairs, this one 120.
  const double unmeasured = 1 - published_figure(kFrontEnd, "vision measures ([0-9.]+) % of all steps") / 100;
  expect_about((1 - found["metric_share"]) * 120 / 400, unmeasured, "share of steps that vision does not measure");
}

TEST(PublishedFigures, HoldForTheBytesOfAKeyframe) {
  const auto kilobytes = published(kFrontEnd,
                                   "a keyframe has ([0-9]+) kB on the simulated street\\. With `--picture small` "
                                   "\\(a thumbnail for display\\) it has ([0-9]+) kB, with `none` "
                                   "([0-9]+),");
  const storage::TemporaryFolder folder;
  const std::string drive = record_simulation(folder / "drive", {"--seed", "3", "--pairs", "24", "--laps", "0.02"});
  const char* const kPictures[] = {"whole", "small", "none"};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string file = folder / (std::string(kPictures[i]) + ".bin");
    const Finished done = run_program(
        {built_program("relmap-frontend"), drive, "--robot", "r", "--out", file, "--picture", kPictures[i], "--quiet"});
    ASSERT_EQ(done.exit_code, 0) << done.standard_error;
    const double bytes = static_cast<double>(std::filesystem::file_size(file));
    expect_about(1e-3 * bytes / static_cast<double>(read_keyframes(file).size()), kilobytes.at(i),
                 std::string("kB a keyframe, ") + kPictures[i]);
  }
}

}  // namespace
}  // namespace relmap::testing
