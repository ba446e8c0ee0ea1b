#include "tools/bench/rba_measures.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "server/rba/local_map.h"
#include "server/rba/measurement.h"
#include "server/rba/region.h"

namespace relmap::bench {

double reprojection_rms(Map& map) {
  rba::LocalMap local(map);
  rba::Region region(local, RbaOptions().max_observations_per_landmark);
  for (const Session& session : map.sessions())
    for (std::uint64_t index = session.first; session.frames > 0 && index <= session.last; ++index) {
      const std::int32_t frame = local.frame({session.number, static_cast<std::uint32_t>(index)});
      if (frame >= 0) region.activate(frame);
    }
  rba::Problem problem;
  region.build(&problem);
  std::vector<SE3> poses;
  problem.compose(&poses);
  double sum = 0, coordinates = 0;
  for (const rba::ProblemLandmark& point : problem.landmarks)
    for (std::int32_t o = point.first_observation; o < point.end_observation; ++o) {
      const rba::ProblemObservation& seen = problem.observations[o];
      StereoPixel h;
      if (!rba::predict(problem.cameras[seen.camera], rba::scaled_point(poses[seen.node], point.abr), point.abr.z(),
                        &h))
        continue;
      sum += rba::residual(seen.z, seen.mono, h).squaredNorm();
      coordinates += seen.mono ? 2 : 3;
    }
  return std::sqrt(sum / coordinates);
}

EdgeConsistency edge_consistency(SimulatedDrive& drive, std::uint32_t first) {
  constexpr std::uint32_t kNewest = 5;
  EdgeConsistency result;
  double sum = 0;
  for (std::uint32_t i = first; i + kNewest < drive.driven(); ++i) {
    const auto hot = drive.map().hot(drive.frame(i));
    const Edge& edge = hot->edges.front();
    const SE3 truth = drive.world().T_world_frame(i - 1).inverse() * drive.world().T_world_frame(i);
    const Vector6 error = (truth.inverse() * edge.T_ab).log();
    sum += error.dot(edge.covariance.llt().solve(error));
    ++result.edges;
  }
  result.nees_mean = sum / result.edges;
  return result;
}

std::uint32_t unsupported_edges(SimulatedDrive& drive) {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < drive.driven(); ++i) {
    const auto hot = drive.map().hot(drive.frame(i));
    for (const Edge& edge : hot->edges)
      if (edge.in_graph() && edge.support < kMinSupport && !edge.prior_active) ++count;
  }
  return count;
}

std::uint64_t landmarks(SimulatedDrive& drive) {
  std::uint64_t count = 0;
  for (std::uint32_t i = 0; i < drive.driven(); ++i) count += drive.map().hot(drive.frame(i))->landmarks.size();
  return count;
}

}  // namespace relmap::bench
