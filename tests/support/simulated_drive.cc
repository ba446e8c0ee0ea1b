#include "tests/support/simulated_drive.h"

#include <chrono>
#include <limits>
#include <map>

#include "proto/base/crc32c.h"
#include "server/place/older_views.h"
#include "storage/engine/memory_engine.h"
#include "storage/graph/path_tree.h"
#include "tools/sim/random.h"

namespace relmap::testing {

namespace {

constexpr double kClosureSigmaM = 0.01;
constexpr double kClosureSigmaRad = 0.002;
constexpr std::size_t kClosureInliers = 20;
constexpr std::uint32_t kClosureStretch = 16;                      // frames that are recognised in the same earlier lap
constexpr std::uint64_t kClosureNoise = 1000, kClosureLap = 1001;  // streams

constexpr storage::PathLimits kWholeMap{
    std::numeric_limits<std::uint32_t>::max(), std::numeric_limits<std::uint32_t>::max(), {}};

std::unique_ptr<storage::Map> open_map() {
  auto engine = storage::make_memory_engine();
  const std::uint64_t epoch = engine->acquire().or_throw();
  return storage::Map::open(std::move(engine), epoch, std::make_shared<storage::Budget>(std::size_t{4} << 30))
      .or_throw();
}

}  // namespace

SimulatedDrive::SimulatedDrive(sim::PointsWorldOptions world, rba::RbaOptions rba, DriveClosures closures)
    : SimulatedDrive(std::move(world), rba, closures, open_map()) {}

SimulatedDrive::SimulatedDrive(sim::PointsWorldOptions world, rba::RbaOptions rba, DriveClosures closures,
                               std::unique_ptr<storage::Map> map)
    : world_(std::move(world)), closures_(closures), map_(std::move(map)), rba_(rba) {
  builder_ = std::make_unique<map::MapBuilder>(*map_, nullptr, rba_, closures_.loop_edge_spacing);
  const Keyframe first = world_.keyframe(0);
  builder_->apply(++sequence_, storage::SessionRecord{kSession, first.session.name, first.session});
}

void SimulatedDrive::drive(std::uint32_t end) {
  for (std::uint32_t i = driven(); i < std::min(end, world_.size()); ++i) {
    const Bytes payload = encode_keyframe(world_.keyframe(i));
    steps_.emplace_back();
    apply(storage::KeyframeRecord{kSession, crc32c(payload), payload});
    if (closures_.proposed && i >= world_.options().frames_per_lap) propose_closure(i);
  }
}

void SimulatedDrive::apply(const storage::JournalRecord& record) {
  const auto start = std::chrono::steady_clock::now();
  const map::Applied applied = builder_->apply(++sequence_, record);
  DriveStep& step = steps_.back();
  step.apply_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  step.relax_seconds += applied.relax_seconds;
  for (const EdgeId id : applied.closures.accepted) {
    step.closure = true;
    step.loop_edge = step.loop_edge || storage::find_edge(*map_, id)->carries;
  }
  const rba::RbaSummary& summary = applied.relaxation;
  step.active_frames = std::max(step.active_frames, summary.active_frames);
  step.solves += summary.solves;
  step.iterations += summary.iterations;
  step.failures += summary.failures;
  step.work += summary.work;
}

std::optional<storage::ClosureProposalRecord> simulated_closure(const storage::Map& map, const sim::PointsWorld& world,
                                                                std::uint32_t i, FrameId query, std::uint32_t match,
                                                                FrameId match_frame) {
  std::map<sim::PointId, std::size_t> seen_before;
  const auto before = world.landmarks(match), now = world.landmarks(i);
  for (std::size_t k = 0; k < before.size(); ++k) seen_before.emplace(before[k], k);
  storage::ClosureProposalRecord proposal;
  proposal.query = query;
  proposal.match = match_frame;
  const auto warm = map.warm(match_frame);
  for (std::size_t k = 0; k < now.size(); ++k) {
    const auto at = seen_before.find(now[k]);
    if (at == seen_before.end()) continue;
    storage::ProposedBinding binding;
    binding.landmark = warm->observations[at->second].landmark;
    binding.track = static_cast<std::int32_t>(k);
    proposal.bindings.push_back(binding);
  }
  if (proposal.bindings.size() < kClosureInliers) return std::nullopt;
  sim::Stream noise(world.options().noise_seed, kClosureNoise, i);
  Vector6 xi;
  for (int k = 0; k < 6; ++k) xi[k] = noise.normal() * (k < 3 ? kClosureSigmaM : kClosureSigmaRad);
  proposal.T_match_query = world.T_world_frame(match).inverse() * world.T_world_frame(i) * SE3::exp(xi);
  proposal.covariance.setZero();
  proposal.covariance.diagonal().head<3>().setConstant(kClosureSigmaM * kClosureSigmaM);
  proposal.covariance.diagonal().tail<3>().setConstant(kClosureSigmaRad * kClosureSigmaRad);
  proposal.inliers = static_cast<std::uint16_t>(proposal.bindings.size());
  proposal.probability = 1;
  proposal.spread = 1;
  return proposal;
}

void SimulatedDrive::propose_closure(std::uint32_t i) {
  const std::uint32_t lap = world_.options().frames_per_lap;
  sim::Stream random(world_.options().world_seed, kClosureLap, i / kClosureStretch);
  const auto match = static_cast<std::uint32_t>(i % lap + lap * (random.bits() % (i / lap)));
  const SE3 T_match_query = world_.T_world_frame(match).inverse() * world_.T_world_frame(i);
  std::vector<place::OlderView> views =
      place::older_views(*map_, frame(match), T_match_query, [](FrameId) { return false; });
  views.push_back({frame(match), T_match_query});
  for (const auto& [view, T_view_query] : views)
    if (const auto proposal = simulated_closure(*map_, world_, i, frame(i), view.index, view)) return apply(*proposal);
}

rba::RbaSummary SimulatedDrive::relax_fully() { return rba::Relaxer(*map_, rba_).relax_fully(); }

rba::RbaSummary SimulatedDrive::relax_idle(std::uint64_t budget) {
  return rba::Relaxer(*map_, rba_).relax_pending(budget);
}

std::vector<SE3> SimulatedDrive::truth() const {
  std::vector<SE3> poses;
  for (std::uint32_t i = 0; i < driven(); ++i) poses.push_back(world_.T_world_frame(i));
  return poses;
}

sim::RegistrationError SimulatedDrive::registration_error(std::size_t stride) const {
  return sim::registration_error(
      truth(),
      [&](std::size_t root) {
        std::vector<std::optional<SE3>> unrolled(driven());
        const storage::PathTree tree =
            storage::build_path_tree(*map_, frame(static_cast<std::uint32_t>(root)), kWholeMap);
        const auto poses = storage::poses_along(*map_, tree);
        for (std::size_t n = 0; n < poses.size(); ++n) unrolled[tree.nodes[n].frame.index] = poses[n];
        return unrolled;
      },
      stride);
}

sim::RegistrationError SimulatedDrive::odometry_registration_error(std::size_t stride) const {
  std::vector<SE3> odometry;
  for (std::uint32_t i = 0; i < driven(); ++i) odometry.push_back(world_.T_odom_frame(i));
  return sim::registration_error(
      truth(),
      [&](std::size_t root) {
        std::vector<std::optional<SE3>> unrolled;
        for (const SE3& pose : odometry) unrolled.emplace_back(odometry[root].inverse() * pose);
        return unrolled;
      },
      stride);
}

sim::RevisitError SimulatedDrive::revisit_error() const {
  const auto poses = truth();
  std::vector<std::int64_t> times;
  for (std::uint32_t i = 0; i < driven(); ++i) times.push_back(map_->hot(frame(i))->time_us);
  return sim::revisit_error(poses, sim::find_revisits(poses, times), [&](std::size_t a, std::size_t b) {
    const FrameId from = frame(static_cast<std::uint32_t>(a)), to = frame(static_cast<std::uint32_t>(b));
    storage::PathLimits limits = kWholeMap;
    limits.until = to;
    const storage::PathTree tree = storage::build_path_tree(*map_, from, limits);
    const storage::PathNode* node = tree.find(to);
    if (node == nullptr) return std::optional<SE3>();
    return std::optional<SE3>(storage::poses_along(*map_, tree)[static_cast<std::size_t>(node - tree.nodes.data())]);
  });
}

}  // namespace relmap::testing
