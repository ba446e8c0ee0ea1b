// What a search knows of the frames at which one part of the map can be entered or left.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/route/overlay/cost_matrix.h"

namespace relmap::route {

// One for each frame, in one block.
class Labels {
 public:
  explicit Labels(std::size_t nodes);

  std::span<double> cost;         // of the cheapest way so far
  std::span<double> pending;      // the cost, where nothing has been done with it yet; kUnreachable elsewhere
  std::span<std::uint64_t> came;  // from where the way comes; not set before it is there
  std::span<std::uint8_t> settled;
  double min_pending = kUnreachable;

 private:
  std::unique_ptr<std::uint8_t[]> block_;
};

// Ways of so much, and then along a row of a SplitCostMatrix: where one is cheaper, the label becomes it and pends. The
// least of the cost there + other[j] over these, `other` being what is left to go; kUnreachable if there is none.
double relax_row(const float* floors, const std::uint16_t* rests, double cost, std::uint64_t from, const double* other,
                 Labels& labels);

// The nodes that pend at no more than `until`, which pend no longer: ascending, into `nodes`. Sets min_pending.
void take_pending(double until, Labels& labels, std::vector<std::uint32_t>& nodes);

}  // namespace relmap::route
