#include "tests/support/simulated_fleet.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/support/process.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

constexpr int kPairs = 125;

// The first left camera of a recording in the world of its circuit.
SE3 read_first_pose(const std::string& recording) {
  const auto numbers =
      nlohmann::json::parse(read_text(recording + "/sim.json")).at("T_world_first").get<std::vector<double>>();
  if (numbers.size() != 12) throw std::runtime_error(recording + "/sim.json: T_world_first has not 12 numbers");
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m(numbers.data());
  return SE3{m.leftCols<3>(), m.col(3)}.normalized();
}

}  // namespace

std::string record_fleet_robot(const std::string& folder, std::size_t robot) {
  return record_simulation(folder + "/robot" + std::to_string(robot),
                           {"--seed", "5", "--drive-seed", std::to_string(robot + 1), "--light", kFleetLights[robot],
                            "--start", std::to_string(6 * robot), "--pairs", std::to_string(kPairs), "--laps",
                            std::to_string(double{kPairs} / kFleetPairsALap), "--step", "0.25"});
}

DriveTruth read_fleet_truth(const std::string& recording) {
  DriveTruth drive = read_truth(recording).or_throw();
  const SE3 T_world_first = read_first_pose(recording);
  for (SE3& pose : drive.poses) pose = T_world_first * pose;
  return drive;
}

FleetClosures closures_of(const storage::Graph& map, const WorldTruth& truth) {
  FleetClosures closures;
  for (const storage::Session& session : map.sessions())
    for (const storage::Edge& edge : edges_of(map, session.number)) {
      if (edge.kind != storage::EdgeKind::kLoop) continue;
      if (edge.state != storage::EdgeState::kAccepted) {
        ++closures.not_accepted;
        continue;
      }
      ++closures.accepted;
      if (const EdgeError error = truth.error(edge); error.wrong) {
        ++(is_wrong(error.off, edge.covariance) ? closures.wrong : closures.vague);
        std::printf(
            "closure %s from %s is off by %.2f m and %.1f degrees; its sigma is %.2f m, %u inliers, support %u\n",
            edge.id.to_string().c_str(), edge.a.to_string().c_str(), error.metres, error.radians * 180 / M_PI,
            std::sqrt(edge.covariance.topLeftCorner<3, 3>().trace()), unsigned{edge.inliers}, edge.support);
      }
      closures.between_robots += edge.a.session != edge.b.session;
    }
  return closures;
}

void FleetClosures::print() const {
  std::printf("fleet: %zu closures accepted, %zu of them between robots, %zu wrong, %zu vague; %zu not accepted\n",
              accepted, between_robots, wrong, vague, not_accepted);
}

}  // namespace relmap::testing
