// Records where a path follows edges along which the robot was carried, as by a lift or a train (Edge::carried_by).
#pragma once

#include <cstddef>
#include <vector>

#include "server/route/stretches.h"

namespace relmap::route {

// Consecutive frames of one session, in the order in which it drove.
struct CarriedStretch {
  FrameId first, last;
  std::vector<EdgeId> closures = {};  // the closures that show it: ascending, at most kMaxNamed

  static constexpr std::size_t kMaxNamed = 16;
  bool operator==(const CarriedStretch&) const = default;
};

class CarriedStretches : public Stretches<CarriedStretch> {
 public:
  void add(const storage::Edge& edge) { add(edge.a, edge.b, edge.carried_by); }
  void add(FrameId a, FrameId b, const std::vector<EdgeId>& carried_by);
};

}  // namespace relmap::route
