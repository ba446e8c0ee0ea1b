// A simulated drive, applied record by record to a map over the memory engine as the daemon would, with the closures
// that perfect place recognition would propose. For tests.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "proto/base/crc32c.h"
#include "server/map/map_builder.h"
#include "storage/engine/memory_engine.h"
#include "tools/sim/points_world.h"

namespace relmap::map {

inline constexpr SessionNumber kDriveSession = 1;

inline storage::SessionRecord session_record(const sim::PointsWorld& world) {
  const Keyframe first = world.keyframe(0);
  return {kDriveSession, first.session.name, first.session};
}

inline storage::KeyframeRecord keyframe_record(const sim::PointsWorld& world, std::uint32_t i) {
  Bytes payload = encode_keyframe(world.keyframe(i));
  const std::uint32_t crc = crc32c(payload);
  return {kDriveSession, crc, std::move(payload)};
}

// The closure that place recognition would propose for frame i with frame i - lap; nullopt on the first lap, or if
// fewer than 5 points are seen again.
inline std::optional<storage::ClosureProposalRecord> true_closure(const storage::Graph& graph,
                                                                  const sim::PointsWorld& world, std::uint32_t i,
                                                                  std::uint32_t lap) {
  if (i < lap) return std::nullopt;
  const std::uint32_t match = i - lap;
  std::unordered_map<sim::PointId, LandmarkId> known;
  for (std::uint32_t k = match < 4 ? 0 : match - 4; k <= match + 4; ++k) {
    const auto points = world.landmarks(k);
    const auto warm = graph.warm({kDriveSession, k});
    for (std::size_t n = 0; n < points.size(); ++n) known.try_emplace(points[n], warm->observations[n].landmark);
  }
  storage::ClosureProposalRecord proposal;
  proposal.query = {kDriveSession, i};
  proposal.match = {kDriveSession, match};
  proposal.T_match_query = world.T_world_frame(match).inverse() * world.T_world_frame(i);
  proposal.covariance = Matrix6::Identity() * 1e-4;
  proposal.probability = 0.99f;
  proposal.spread = 0.5f;
  const auto points = world.landmarks(i);
  for (std::size_t n = 0; n < points.size(); ++n)
    if (const auto found = known.find(points[n]); found != known.end())
      proposal.bindings.push_back({found->second, static_cast<std::int32_t>(n)});
  proposal.inliers = static_cast<std::uint16_t>(proposal.bindings.size());
  if (proposal.bindings.size() < 5) return std::nullopt;
  return proposal;
}

class PointsDrive {
 public:
  explicit PointsDrive(std::shared_ptr<storage::Engine> engine = storage::make_memory_engine(),
                       rba::RbaOptions rba = {})
      : engine_(std::move(engine)), budget_(std::make_shared<storage::Budget>(std::size_t{256} << 20)) {
    map_ = storage::Map::open(engine_, engine_->acquire().or_throw(), budget_).or_throw();
    builder_ = std::make_unique<MapBuilder>(*map_, storage::WordFunction{}, rba);
    sequence_ = map_->state().applied_sequence;
  }

  storage::Map& map() { return *map_; }
  // Not inlined: GCC 12 would take the alternatives that a record does not hold for uninitialised.
  [[gnu::noinline]] Applied apply(const storage::JournalRecord& record) {
    journal_.push_back(record);
    return builder_->apply(++sequence_, record);
  }
  const std::vector<storage::JournalRecord>& journal() const { return journal_; }

  // Takes in frames 0 .. count - 1; from the second lap on proposes closures for the frames i with `propose(i)`.
  void drive(const sim::PointsWorld& world, std::uint32_t count, const std::function<bool(std::uint32_t)>& propose) {
    apply(session_record(world));
    for (std::uint32_t i = 0; i < count; ++i) {
      apply(keyframe_record(world, i));
      if (!propose || !propose(i)) continue;
      if (auto proposal = true_closure(*map_, world, i, world.options().frames_per_lap)) apply(*proposal);
    }
  }

 private:
  std::shared_ptr<storage::Engine> engine_;
  std::shared_ptr<storage::Budget> budget_;
  std::unique_ptr<storage::Map> map_;
  std::unique_ptr<MapBuilder> builder_;
  std::uint64_t sequence_ = 0;
  std::vector<storage::JournalRecord> journal_;
};

}  // namespace relmap::map
