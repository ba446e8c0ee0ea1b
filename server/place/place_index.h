// FAB-MAP over inverted lists (docs/method.md, 7): which places of the map could have been seen with these words?
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
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

// Thread-safe: one writer, any number of readers.
class PlaceIndex {
 public:
  explicit PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary);
  ~PlaceIndex();

  // Places are added in any order; one that is there already stays as it is. `words` need not be sorted or unique.
  void add(FrameId frame, std::span<const std::uint32_t> words);

  // `masked(frame)`: left out as candidates and from the sum (the query's own recent past). `graph` gives neighbours.
  PlaceAnswer query(std::span<const std::uint32_t> words, const Graph& graph,
                    const std::function<bool(FrameId)>& masked = {}) const;

  std::size_t size() const;
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap
