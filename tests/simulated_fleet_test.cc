// Robots drive the same circuit of one world, each with its own start, drive and light. Their sessions are unconnected
// until a place is recognised; then they share one map, to which later robots add little.
#include "tests/support/simulated_fleet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "storage/graph/binding.h"
#include "tests/support/streamed_sessions.h"
#include "tests/support/world_truth.h"

namespace relmap::testing {
namespace {

// What one robot's first time round the circuit brought.
struct Lap {
  std::uint32_t frames = 0, landmarks = 0, bound = 0;  // bound: frames with 20 observations of others' landmarks
  std::uint32_t edges = 0, weak_edges = 0;             // weak: with fewer than 20 supporting observations
  double error_m = 0, error_rad = 0;                   // of odometry's edges, mean

  void print(SessionNumber robot) const {
    std::printf("robot %u: %u keyframes, %u bound, %u landmarks; %u edges, %u weak; %.2f mm, %.4f degrees off a step\n",
                robot, frames, bound, landmarks, edges, weak_edges, 1e3 * error_m, error_rad * 180 / M_PI);
  }
};

Lap first_lap(const storage::Graph& map, const WorldTruth& truth, SessionNumber session) {
  Lap lap;
  std::uint32_t steps = 0;
  const std::int64_t begin = map.session(session)->first_time_us;
  for (std::uint32_t i = 0; i <= map.session(session)->last; ++i) {
    const auto hot = map.hot({session, i});
    if (!hot || hot->time_us - begin >= kFleetPairsALap * 100'000) continue;
    ++lap.frames;
    for (std::uint32_t slot = 0; slot < hot->landmarks.size(); ++slot)
      lap.landmarks += storage::resolve(map, {{session, i}, slot}) == LandmarkId{{session, i}, slot};
    lap.bound += observations_of_old(map, {session, i}, [&](FrameId base) { return base.session < session; }) >= 20;
    for (const storage::Edge& edge : hot->edges) {
      if (!edge.in_graph()) continue;
      ++lap.edges;
      lap.weak_edges += edge.support < storage::kMinSupport;
      if (edge.kind != storage::EdgeKind::kOdometry) continue;
      ++steps;
      const EdgeError error = truth.error(edge);
      lap.error_m += error.metres;
      lap.error_rad += error.radians;
    }
  }
  lap.error_m /= steps;
  lap.error_rad /= steps;
  return lap;
}

// `robots` drive one after another.
void expect_one_map(const std::vector<std::size_t>& robots) {
  const storage::TemporaryFolder folder;
  StreamedSessions sessions({"--deterministic"});
  std::vector<std::string> recordings;
  for (const std::size_t robot : robots) {
    recordings.push_back(record_fleet_robot(folder / "", robot));
    sessions.stream("sim", recordings.back(), std::string("robot in the ") + kFleetLights[robot]);
  }
  const storage::Graph& map = sessions.stop();
  WorldTruth truth;
  std::vector<SessionNumber> all;
  for (const std::string& recording : recordings) {
    all.push_back(static_cast<SessionNumber>(all.size() + 1));
    truth.add(map, all.back(), read_fleet_truth(recording));
  }

  EXPECT_EQ(joined_sessions(map), (std::vector<std::vector<SessionNumber>>{all}));
  const FleetClosures closures = closures_of(map, truth);
  closures.print();
  EXPECT_EQ(closures.wrong + closures.vague, 0u);
  EXPECT_GT(closures.between_robots, 10 * (robots.size() - 1));

  // A later pass adds little, and measures what it passes as exactly as the first (docs/decisions/refinement.md).
  const Lap first = first_lap(map, truth, 1);
  first.print(1);
  EXPECT_LT(first.error_m, 0.0023);
  double later_error_m = 0;
  for (const SessionNumber session : all) {
    if (session == 1) continue;
    const char* light = kFleetLights[robots[session - 1]];
    const Lap later = first_lap(map, truth, session);
    later.print(session);
    EXPECT_EQ(later.weak_edges, 0u) << light;
    EXPECT_EQ(later.bound, later.frames) << light;
    EXPECT_LT(later.landmarks, 0.3 * first.landmarks) << light;
    EXPECT_LT(later.error_m, 1.2 * first.error_m) << light;
    later_error_m += later.error_m / static_cast<double>(all.size() - 1);
    if (session == kFleetLights.size()) {
      EXPECT_LT(later.landmarks, 0.02 * first.landmarks) << "the place has its landmarks";
    }
  }
  EXPECT_LT(later_error_m, 1.1 * first.error_m);
}

TEST(SimulatedFleet, RobotsInDifferentLightShareOneMap) { expect_one_map({0, 1}); }

TEST(LongSimulatedFleet, FiveRobotsInDifferentLightShareOneMap) { expect_one_map({0, 1, 2, 3, 4}); }

// No order is agreed upon, the worker is behind, and sessions that have grown for a while join.
TEST(SimulatedFleet, RobotsThatDriveAtOnceShareOneMap) {
  const storage::TemporaryFolder folder;
  StreamedSessions sessions;
  std::vector<std::pair<std::string, std::string>> recordings;
  for (const std::size_t robot : {0, 1, 4})
    recordings.emplace_back(record_fleet_robot(folder / "", robot), std::string("robot in the ") + kFleetLights[robot]);
  sessions.stream_together("sim", recordings);
  const storage::Map& map = sessions.stop();
  WorldTruth truth;
  std::uint64_t frames = 0;
  for (const storage::Session& session : map.sessions()) {
    const auto recording = std::find_if(recordings.begin(), recordings.end(),
                                        [&](const auto& entry) { return entry.second == session.header.name; });
    ASSERT_NE(recording, recordings.end());
    truth.add(map, session.number, read_fleet_truth(recording->first));
    frames += session.frames;
  }
  EXPECT_EQ(joined_sessions(map), (std::vector<std::vector<SessionNumber>>{{1, 2, 3}}));
  const FleetClosures closures = closures_of(map, truth);
  closures.print();
  // Which frames see a place first differs from run to run, and so do closures from afar, which say how vague they are.
  EXPECT_EQ(closures.wrong, 0u);
  EXPECT_LT(closures.vague, 0.03 * static_cast<double>(closures.accepted));
  EXPECT_GT(closures.between_robots, 40);
  EXPECT_GT(closures.accepted, frames / 3);
}

}  // namespace
}  // namespace relmap::testing
