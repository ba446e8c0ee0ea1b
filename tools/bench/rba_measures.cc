#include "tools/bench/rba_measures.h"

#include <cmath>
#include <unordered_set>

#include "proto/geometry/covariance.h"
#include "server/rba/local_map.h"
#include "server/rba/measurement.h"
#include "server/rba/region.h"
#include "server/route/transform.h"
#include "storage/graph/binding.h"

namespace relmap::bench {

double reprojection_rms(storage::Map& map) {
  rba::LocalMap local(map);
  rba::Region region(local, rba::RbaOptions().own_step);
  for (const storage::Session& session : map.sessions())
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

double nees_of_chains(testing::SimulatedDrive& drive, std::uint32_t edges) {
  constexpr std::uint32_t kFirst = 10, kNewest = 5;
  double sum = 0;
  std::uint32_t chains = 0;
  for (std::uint32_t end = kFirst + edges - 1; end + kNewest < drive.driven(); ++end) {
    const route::Transform found =
        route::transform_between(drive.map(), drive.frame(end - edges), drive.frame(end)).or_throw();
    if (found.edges != edges) continue;  // there is a shorter way, over a loop edge
    const SE3 truth = drive.world().T_world_frame(end - edges).inverse() * drive.world().T_world_frame(end);
    const Vector6 error = (truth.inverse() * found.T_ab).log();
    sum += mahalanobis_squared(error, found.covariance);
    ++chains;
  }
  return sum / chains;
}

std::uint32_t unsupported_edges(testing::SimulatedDrive& drive) {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < drive.driven(); ++i) {
    const auto hot = drive.map().hot(drive.frame(i));
    for (const storage::Edge& edge : hot->edges)
      if (edge.in_graph() && edge.support < storage::kMinSupport && !edge.prior_active) ++count;
  }
  return count;
}

std::uint64_t landmarks(testing::SimulatedDrive& drive) {
  std::uint64_t count = 0;
  for (std::uint32_t i = 0; i < drive.driven(); ++i) count += drive.map().hot(drive.frame(i))->landmarks.size();
  return count;
}

std::uint64_t landmarks_in_force(testing::SimulatedDrive& drive) {
  std::uint64_t count = 0;
  for (std::uint32_t i = 0; i < drive.driven(); ++i) {
    const auto slots = static_cast<std::uint32_t>(drive.map().hot(drive.frame(i))->landmarks.size());
    for (LandmarkId id{drive.frame(i), 0}; id.slot < slots; ++id.slot) count += storage::resolve(drive.map(), id) == id;
  }
  return count;
}

std::uint64_t points_seen(testing::SimulatedDrive& drive) {
  std::unordered_set<sim::PointId> points;
  for (std::uint32_t i = 0; i < drive.driven(); ++i)
    for (const sim::PointId id : drive.world().landmarks(i)) points.insert(id);
  return points.size();
}

}  // namespace relmap::bench
