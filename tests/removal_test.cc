// An operator takes every loop closure of a rendered drive out again, over RPC. What is left is the map of the same
// drive without closures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/testing/comparison.h"
#include "server/rba/rba.h"
#include "tests/support/simulated_recording.h"
#include "tests/support/streamed_sessions.h"

namespace relmap::testing {
namespace {

TEST(Removal, LeavesTheMapOfADriveWithoutClosures) {
  const storage::TemporaryFolder folder;
  const std::string recording =
      record_simulation(folder / "drive", {"--seed", "5", "--pairs", "150", "--laps", "1.25", "--step", "0.25"});
  StreamedSessions drive({"--deterministic"}), without({"--deterministic", "--no-closures"});
  drive.stream("sim", recording, "robot");
  without.stream("sim", recording, "robot");

  client::EdgeFilter in_force;
  in_force.states = {client::EdgeState::kAccepted};
  in_force.kinds = {client::EdgeKind::kLoop};
  std::size_t removals = 0, removed = 0;
  for (;;) {
    const auto accepted = drive.client().edges(in_force);
    ASSERT_TRUE(accepted.ok()) << accepted.status().to_string();
    if (accepted->empty()) break;
    const auto change = drive.client().edit_edge(accepted->front().id, client::EdgeAction::kRemove, {"test"});
    ASSERT_TRUE(change.ok()) << change.status().to_string();
    ++removals;
    for (const client::ClosureChange& closure : change->effect.closures)
      removed += closure.before == client::EdgeState::kAccepted && closure.after == client::EdgeState::kRemoved;
    ASSERT_TRUE(drive.client().wait_idle().ok());
  }
  EXPECT_GT(removed, 5u);
  std::printf("%zu closures taken out in %zu removals\n", removed, removals);

  storage::Map& mine = drive.stop();
  storage::Map& other = without.stop();
  EXPECT_THAT(map::structural_differences(mine, other, 1), ::testing::IsEmpty());
  EXPECT_LE(map::largest_difference(mine, other, 1).sigmas, 0.5) << "after idle work";
  for (storage::Map* map : {&mine, &other}) rba::Relaxer(*map, rba::RbaOptions()).relax_fully();
  const map::Difference solved = map::largest_difference(mine, other, 1);
  std::printf("solved: %.2g m, %.2g rad\n", solved.metres, solved.radians);
  EXPECT_LE(solved.metres, 1e-6);
  EXPECT_LE(solved.radians, 1e-6);
}

}  // namespace
}  // namespace relmap::testing
