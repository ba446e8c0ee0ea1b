// Joins several neighbouring cells to one. They are merged two by two, each time the pair with the most edges between
// them for their size, as sparse solvers eliminate in nested order: no matrix is larger than the borders of two
// neighbouring parts. The order is found once and then applied to one metric after another.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/route/overlay/cell.h"

namespace relmap::route {

class Joining {
 public:
  // `frames` and `facts` are those of the parts.
  Joining(std::vector<CellFrames> frames, std::span<const CellFacts> facts);
  Joining(const Joining&) = delete;
  Joining& operator=(const Joining&) = delete;

  const CellFacts& facts() const { return facts_; }
  const CellFrames& frames() const { return frames_; }
  // The costs between the frames, given the matrices of the parts.
  CostMatrix within(const RouteWeights& metric, std::vector<CostMatrix> parts) const;

 private:
  struct Node {
    FrameId frame;
    std::uint32_t part, in_part;
    std::uint32_t front;
    bool border = false;      // a link leads out of all parts
    bool eliminated = false;  // no link leads out of its front any more
  };
  struct InnerLink {
    std::uint32_t to;  // node
    const Link* link;
  };
  // Front b is merged into front a. The nodes that stay on the border come first, then those that are eliminated.
  struct Merge {
    std::uint32_t a, b;
    std::size_t nodes, kept;
    std::vector<std::uint32_t> places_of_a, places_of_b;
    struct Crossing {
      std::uint32_t from, to;
      const Link* link;
    };
    std::vector<Crossing> crossings;
  };

  std::uint32_t find(FrameId frame) const;
  bool merge_best();
  void merge(std::uint32_t a, std::uint32_t b);
  void border();

  const std::vector<CellFrames> parts_;
  std::vector<Node> nodes_;                              // by frame
  std::vector<std::vector<InnerLink>> links_;            // by node
  std::vector<std::vector<std::uint32_t>> front_nodes_;  // the nodes of each front; empty once it is merged
  std::vector<bool> alive_;
  std::vector<std::vector<std::uint32_t>> tied_;  // how many links lead from one front to another
  std::vector<Merge> merges_;
  std::vector<std::vector<std::uint32_t>> places_;  // for each front, the indices of its nodes in frames_
  CellFacts facts_;
  CellFrames frames_;
};

}  // namespace relmap::route
