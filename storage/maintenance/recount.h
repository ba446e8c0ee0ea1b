// Where the sums of a ChunkTable are not zero, derived fields are computed again from the facts, item by item, and
// compared with what is stored.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "storage/maintenance/chunk_table.h"
#include "storage/maintenance/stored_graph.h"

namespace relmap::storage {

// A derived field of a frame that is not as it should be, with its right value. `kind` says which of the members are
// set.
struct Difference {
  Derived kind = Derived::kIncoming;
  FrameId frame;     // the frame that holds the item
  std::string what;  // in words

  std::vector<EdgeId> incoming;      // kIncoming: all of the frame's
  std::uint32_t slot = 0;            // kObservers: of the landmark,
  std::vector<FrameId> observers;    //   the first that see it
  std::vector<Unreached> unreached;  // kUnreached: all of the frame's
  EdgeId edge;                       // kSupport, kBound, kConsistent, kCarriedBy: the edge,
  std::uint32_t count = 0;           //   its count, or
  std::vector<EdgeId> closures;      //   all that agree with it, or say that the robot was carried along it
};

// Holds `memory_bytes` at most; if that is not enough, it makes several passes over the facts. Returns the most that it
// held. `progress` is called with the number of frames done, and may throw.
std::size_t recount_derived(const EngineSnapshot& snapshot, const StoredGraph& graph, ChunkTable& table,
                            std::size_t memory_bytes, const std::function<void(const Difference&)>& differs,
                            const std::function<void(std::uint64_t)>& progress);

}  // namespace relmap::storage
