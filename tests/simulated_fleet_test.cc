// Five robots drive the same circuit of one world, each in its own way, from its own start and in another light. They
// are strangers until a place is recognised; then they share one map, in which those who come later add little.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "storage/binding.h"
#include "tests/support/simulated_recording.h"
#include "tests/support/streamed_sessions.h"
#include "tests/support/world_truth.h"
#include "tools/bench/drive_evaluation.h"

namespace relmap::testing {
namespace {

constexpr std::array<const char*, 5> kLights{"clear", "morning", "evening", "overcast", "dusk"};
constexpr int kPairsALap = 100, kPairs = 125;

std::string record(const std::string& folder, std::size_t robot) {
  return record_simulation(folder + "/robot" + std::to_string(robot),
                           {"--seed", "5", "--drive-seed", std::to_string(robot + 1), "--light", kLights[robot],
                            "--start", std::to_string(6 * robot), "--pairs", std::to_string(kPairs), "--laps",
                            std::to_string(double{kPairs} / kPairsALap), "--step", "0.25"});
}

// The first left camera of a recording in the world of its circuit.
SE3 read_first_pose(const std::string& recording) {
  const std::string text = read_text(recording + "/sim.json"), key = "\"T_world_first\": [";
  if (text.find(key) == std::string::npos) throw std::runtime_error(recording + "/sim.json has no " + key);
  const char* at = text.c_str() + text.find(key) + key.size();
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m;
  for (int i = 0; i < 12; ++i) {
    char* end = nullptr;
    m.data()[i] = std::strtod(at, &end);
    at = end + 1;
  }
  return SE3{m.leftCols<3>(), m.col(3)}.normalized();
}

void add_truth(const Graph& map, const std::string& recording, SessionNumber session, WorldTruth& truth) {
  bench::DriveTruth drive = bench::read_truth(recording).or_throw();
  const SE3 T_world_first = read_first_pose(recording);
  for (SE3& pose : drive.poses) pose = T_world_first * pose;
  truth.add(map, session, drive);
}

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

Lap first_lap(const Graph& map, const WorldTruth& truth, SessionNumber session) {
  Lap lap;
  std::uint32_t steps = 0;
  const std::int64_t begin = map.session(session)->first_time_us;
  for (std::uint32_t i = 0; i <= map.session(session)->last; ++i) {
    const auto hot = map.hot({session, i});
    if (!hot || hot->time_us - begin >= kPairsALap * 100'000) continue;
    ++lap.frames;
    for (std::uint32_t slot = 0; slot < hot->landmarks.size(); ++slot)
      lap.landmarks += resolve(map, {{session, i}, slot}) == LandmarkId{{session, i}, slot};
    lap.bound += observations_of_old(map, {session, i}, [&](FrameId base) { return base.session < session; }) >= 20;
    for (const Edge& edge : hot->edges) {
      if (!edge.in_graph()) continue;
      ++lap.edges;
      lap.weak_edges += edge.support < kMinSupport;
      if (edge.kind != EdgeKind::kOdometry) continue;
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

TEST(SimulatedFleet, FiveRobotsInDifferentLightShareOneMap) {
  const TemporaryFolder folder;
  StreamedSessions sessions({"--deterministic"});
  std::vector<std::string> recordings;
  for (std::size_t robot = 0; robot < kLights.size(); ++robot) {
    recordings.push_back(record(folder / "", robot));
    sessions.stream("sim", recordings.back(), std::string("robot in the ") + kLights[robot]);
  }
  const Graph& map = sessions.stop();
  WorldTruth truth;
  for (std::size_t robot = 0; robot < kLights.size(); ++robot)
    add_truth(map, recordings[robot], static_cast<SessionNumber>(robot + 1), truth);

  EXPECT_EQ(joined_sessions(map), (std::vector<std::vector<SessionNumber>>{{1, 2, 3, 4, 5}}));
  int right = 0, wrong = 0, candidates = 0, between = 0;
  for (SessionNumber session = 1; session <= kLights.size(); ++session)
    for (const Edge& edge : edges_of(map, session)) {
      if (edge.kind != EdgeKind::kLoop) continue;
      const bool is_wrong = truth.error(edge).wrong;
      if (edge.state != EdgeState::kAccepted)
        ++candidates;
      else
        ++(is_wrong ? wrong : right);
      between += edge.state == EdgeState::kAccepted && edge.a.session != edge.b.session;
    }
  std::printf("fleet: %d closures accepted, %d of them between robots, %d wrong; %d not accepted\n", right + wrong,
              between, wrong, candidates);
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(between, 40);

  // A later pass adds little, and measures what it passes as exactly as the first (docs/decisions.md).
  const Lap first = first_lap(map, truth, 1);
  first.print(1);
  EXPECT_LT(first.error_m, 0.0023);
  double later_error_m = 0;
  for (SessionNumber session = 2; session <= kLights.size(); ++session) {
    const Lap later = first_lap(map, truth, session);
    later.print(session);
    EXPECT_EQ(later.weak_edges, 0u) << kLights[session - 1];
    EXPECT_EQ(later.bound, later.frames) << kLights[session - 1];
    EXPECT_LT(later.landmarks, 0.3 * first.landmarks) << kLights[session - 1];
    EXPECT_LT(later.error_m, 1.2 * first.error_m) << kLights[session - 1];
    later_error_m += later.error_m / (kLights.size() - 1);
    if (session == kLights.size()) {
      EXPECT_LT(later.landmarks, 0.02 * first.landmarks) << "the place has its landmarks";
    }
  }
  EXPECT_LT(later_error_m, 1.1 * first.error_m);
}

}  // namespace
}  // namespace relmap::testing
