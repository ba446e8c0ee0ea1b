// A simulated street, driven 1.25 times round, becomes a map: the counterpart of real_data_test that always runs.
#include <gtest/gtest.h>

#include "frontend/vision/encoded_picture.h"
#include "frontend/vision/picture.h"
#include "tests/support/published.h"
#include "tests/support/simulated_recording.h"
#include "tests/support/streamed_drive_checks.h"

namespace relmap::testing {
namespace {

TEST(SimulatedStreet, DrivenMoreThanOnceRoundBecomesAMapThatAnswers) {
  constexpr std::size_t kPairs = 150;
  const storage::TemporaryFolder folder;
  const std::string recording = record_simulation(
      folder / "drive", {"--seed", "5", "--pairs", std::to_string(kPairs), "--laps", "1.25", "--step", "0.25"});
  StreamedDrive drive(recording);
  expect_every_pair_processed(drive, kPairs);
  // A half more than was ever found (5 mm, 22 mm).
  expect_localised(drive, {17, 58, 93}, 0.0075);
  expect_localised_by_a_photograph(drive, {17, 58, 93}, 0.033);
  expect_routed(drive, 5, drive.frame_near(60), drive.metres_between(5, 60));
  // Keyframes come with whole pictures; what is asked to look at them is given little.
  const auto shown = drive.client().frame(drive.frame_near(17), true).or_throw();
  const Bytes thumbnail(shown.thumbnail.begin(), shown.thumbnail.end());
  EXPECT_LE(thumbnail.size(), vision::kMaxThumbnailBytes);
  EXPECT_EQ(vision::picture_size(thumbnail).or_throw().width, 160);
  const DriveEvaluation judged = evaluate_drive(drive.stop(), drive.session().number, drive.truth());
  EXPECT_EQ(judged.keyframes_without_truth, 0u);
  EXPECT_EQ(judged.closures_wrong, 0u);
  EXPECT_GT(judged.closures_right, 0u);
  EXPECT_GT(judged.revisits, 5u);
  EXPECT_EQ(judged.revisits_bound, judged.revisits);
  const double published_mm =
      published_figure("README.md", "error of revisiting positions, closures off and on \\| [0-9.]+ cm, ([0-9.]+) mm");
  EXPECT_LE(1e3 * judged.revisit_error_m, 1.5 * published_mm);
  std::printf("%u revisits, %u bound, %.3f m off\n", judged.revisits, judged.revisits_bound, judged.revisit_error_m);
  const auto published_percent = published(
      "docs/frontend.md", "over segments of 8 m its odometry drifts by ([0-9.]+) %, and the map by ([0-9.]+) %");
  expect_drift_below(
      drive, {.odometry = kFactor * published_percent.at(0) / 100, .map = kFactor * published_percent.at(1) / 100}, {8},
      20);
}

}  // namespace
}  // namespace relmap::testing
