// Adds keyframes of any origin to a map over the memory engine, as a worker would.
#pragma once

#include <memory>
#include <vector>

#include "server/map/map_builder.h"
#include "storage/map/map.h"

namespace relmap::bench {

class RecordedDrive {
 public:
  explicit RecordedDrive(const rba::RbaOptions& rba);

  // Adds a keyframe; all must be of one session. Throws StatusError (CORRUPT) if the map refuses it.
  void add(const Keyframe& keyframe);
  map::Applied propose(const storage::ClosureProposalRecord& closure) { return builder_->apply(++sequence_, closure); }
  // The full solution: everything active, to convergence.
  rba::RbaSummary relax_fully();

  storage::Map& map() { return *map_; }
  std::uint32_t driven() const { return static_cast<std::uint32_t>(update_us_.size()); }
  static FrameId frame(std::uint32_t sequence) { return {kSession, sequence}; }
  const std::vector<double>& update_us() const { return update_us_; }  // of each keyframe's relaxation

 private:
  static constexpr SessionNumber kSession = 1;

  const rba::RbaOptions rba_;
  std::unique_ptr<storage::Map> map_;
  std::unique_ptr<map::MapBuilder> builder_;
  std::uint64_t sequence_ = 0;
  std::vector<double> update_us_;
};

}  // namespace relmap::bench
