// Where a way leads along edges that nothing measured (is_unmeasured()): how long it is there, and where it leads, are
// guesses.
#pragma once

#include <cstdint>

#include "server/route/stretches.h"

namespace relmap::route {

// Frames of one session, in the order in which it drove; one after the other along its motion.
struct UnmeasuredStretch {
  FrameId first, last;
  std::uint32_t steps = 0;
  double distance_m = 0;

  bool operator==(const UnmeasuredStretch&) const = default;
};

class UnmeasuredStretches : public Stretches<UnmeasuredStretch> {
 public:
  // Of any edge of the way.
  void add(const storage::Edge& edge);
  // Of all stretches, those that are one too many for list(), too.
  std::uint32_t steps() const { return steps_; }
  double distance_m() const { return distance_m_; }

 private:
  std::uint32_t steps_ = 0;
  double distance_m_ = 0;
};

}  // namespace relmap::route
