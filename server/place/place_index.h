// FAB-MAP over inverted lists (docs/method.md, 7): which places of the map could have been seen with these words?
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/ids.h"
#include "server/place/vocabulary.h"
#include "storage/graph.h"

namespace relmap {

struct PlaceCandidate {
  FrameId frame;           // the best frame of the place
  double probability = 0;  // mass of the place: summed over its graph neighbours (5 edges)
};

struct PlaceAnswer {
  std::vector<PlaceCandidate> candidates;  // descending; at least 1e-3 each, at most 20
  double new_place = 1;                    // probability that the map does not hold the place
};

struct PlaceIndexOptions {
  // Bytes of memory. Beyond it the inverted lists, nearly all of the index, go to disk; some 40 bytes a place stay.
  std::size_t allowance = std::numeric_limits<std::size_t>::max();
  // For temporary files. Empty: nothing goes to disk.
  std::string spill_folder;
};

// Thread-safe: one writer, any number of readers. Queries are answered one at a time: each holds memory in proportion
// to the number of places.
class PlaceIndex {
 public:
  explicit PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary, PlaceIndexOptions options = {});
  ~PlaceIndex();

  // Places are added in any order; one that is there already stays as it is. `words` need not be sorted or unique.
  // IO_ERROR (the disk takes nothing), BUDGET_EXCEEDED: the place is left out, and counted by left_out().
  Status add(FrameId frame, std::span<const std::uint32_t> words);

  // `masked(frame)`: left out as candidates and from the sum (the query's own recent past). `graph` gives neighbours.
  // Throws StatusError where reads of the graph do, or of what is on disk.
  PlaceAnswer query(std::span<const std::uint32_t> words, const Graph& graph,
                    const std::function<bool(FrameId)>& masked = {}) const;

  std::size_t size() const;
  std::size_t left_out() const;
  std::size_t memory_bytes() const;  // with a query under way

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap
