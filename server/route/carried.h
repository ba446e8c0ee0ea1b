// Where a way leads along edges on which the robot that drove them was carried (Edge::carried_by): a lift, a train.
#pragma once

#include <cstddef>
#include <vector>

#include "server/route/stretches.h"

namespace relmap::route {

// Frames of one session, in the order in which it drove; one after the other along its motion.
struct CarriedStretch {
  FrameId first, last;
  std::vector<EdgeId> closures = {};  // that say so: ascending, at most kMaxNamed

  static constexpr std::size_t kMaxNamed = 16;
  bool operator==(const CarriedStretch&) const = default;
};

class CarriedStretches : public Stretches<CarriedStretch> {
 public:
  void add(const storage::Edge& edge) { add(edge.a, edge.b, edge.carried_by); }
  void add(FrameId a, FrameId b, const std::vector<EdgeId>& carried_by);
};

}  // namespace relmap::route
