// Where a way leads along edges on which the robot that drove them was carried (Edge::carried_by): a lift, a train.
#pragma once

#include <cstddef>
#include <vector>

#include "storage/frame.h"

namespace relmap {

// Frames of one session, in the order in which it drove; one after the other along its motion.
struct CarriedStretch {
  FrameId first, last;
  std::vector<EdgeId> closures;  // that say so: ascending, at most kMostNamed

  static constexpr std::size_t kMostNamed = 16;
  bool operator==(const CarriedStretch&) const = default;
};

// The stretches of a way whose edges are added one after the other, from either end; kMost of them.
class CarriedStretches {
 public:
  static constexpr std::size_t kMost = 256;

  void add(const Edge& edge) { add(edge.a, edge.b, edge.carried_by); }
  void add(FrameId a, FrameId b, const std::vector<EdgeId>& carried_by);
  void reverse();
  const std::vector<CarriedStretch>& list() const { return list_; }

 private:
  std::vector<CarriedStretch> list_;
};

}  // namespace relmap
