// Records where a path follows edges that no sensor measured (is_unmeasured()): there, length and course are guesses.
#pragma once

#include <cstdint>

#include "server/route/stretches.h"

namespace relmap::route {

// Consecutive frames of one session, in the order in which it drove.
struct UnmeasuredStretch {
  FrameId first, last;
  std::uint32_t steps = 0;
  double distance_m = 0;

  bool operator==(const UnmeasuredStretch&) const = default;
};

class UnmeasuredStretches : public Stretches<UnmeasuredStretch> {
 public:
  // Adds an edge of the path, of any kind.
  void add(const storage::Edge& edge);
  // Totals over all stretches, including those for which list() has no room.
  std::uint32_t steps() const { return steps_; }
  double distance_m() const { return distance_m_; }

 private:
  std::uint32_t steps_ = 0;
  double distance_m_ = 0;
};

}  // namespace relmap::route
