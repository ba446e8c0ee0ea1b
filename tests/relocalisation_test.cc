// A robot that loses sight for ten seconds guesses its way across; once the daemon recognises a later keyframe in the
// map, the robot hears of it and knows where it is again.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/simulated_recording.h"
#include "tests/support/streamed_drive.h"

namespace relmap::testing {
namespace {

TEST(Relocalisation, ARobotThatLostSightIsToldWhereItIs) {
  const storage::TemporaryFolder folder;
  const std::string recording = record_simulation(
      folder / "drive",
      {"--seed", "5", "--pairs", "150", "--laps", "1.35", "--step", "0.4", "--rate", "5", "--faults", "long_black:45"});
  constexpr int kNotToBeTrusted = 5;  // a third of the pairs is black
  StreamedDrive drive(recording, 30, kNotToBeTrusted);
  EXPECT_EQ(drive.summary("unmeasured_steps"), 1);
  EXPECT_EQ(drive.summary("recovered_steps"), 1);
  EXPECT_GT(drive.summary("closures"), 5);
  EXPECT_EQ(drive.summary("closures_withdrawn"), 0);

  const auto place = nlohmann::json::parse(drive.summary_json()).at("place");
  const FrameId frame = FrameId::parse(place.at("frame").get<std::string>()).value();
  const auto translation = place.at("translation").get<std::vector<double>>();
  ASSERT_EQ(translation.size(), 3u);
  const Vector3 t(translation[0], translation[1], translation[2]);
  const SE3 truth = drive.true_T_frame_pair(frame, drive.pair_of(drive.last()));
  EXPECT_LT(drive.pair_of(frame), 45u) << "a frame of before the blackness";
  EXPECT_LT((t - truth.t).norm(), 0.1) << t.transpose() << " for " << truth.t.transpose();
}

}  // namespace
}  // namespace relmap::testing
