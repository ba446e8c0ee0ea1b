// Several cells that lie beside each other, as one. They are joined two by two, each time those that most edges tie for
// their size: the nested order of elimination of sparse solvers, so that no matrix is larger than two neighbouring
// parts' borders. Which, is found once; then it is done for one metric after another.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/route/overlay/cell.h"

namespace relmap::route {

class Joining {
 public:
  // Of the parts.
  Joining(std::vector<CellFrames> frames, std::span<const CellFacts> facts);
  Joining(const Joining&) = delete;
  Joining& operator=(const Joining&) = delete;

  const CellFacts& facts() const { return facts_; }
  const CellFrames& frames() const { return frames_; }
  // Between the frames, of the same between those of each part.
  CostMatrix within(const RouteWeights& metric, std::vector<CostMatrix> parts) const;

 private:
  struct Node {
    FrameId frame;
    std::uint32_t part, in_part;
    std::uint32_t front;
    bool border = false;      // a link leads out of all parts
    bool eliminated = false;  // it lies in the midst of its front
  };
  struct InnerLink {
    std::uint32_t to;  // node
    const Link* link;
  };
  // One becomes another's: first the nodes that stay on its border, then those that end here.
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
  std::vector<std::vector<std::uint32_t>> front_nodes_;  // of the parts joined so far; none: joined to another
  std::vector<bool> alive_;
  std::vector<std::vector<std::uint32_t>> tied_;  // how many links lead from one to another
  std::vector<Merge> merges_;
  std::vector<std::vector<std::uint32_t>> places_;  // of what is left of each, in frames_
  CellFacts facts_;
  CellFrames frames_;
};

}  // namespace relmap::route
