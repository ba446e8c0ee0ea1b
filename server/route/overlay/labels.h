// The labels of a search for the frames at which one part of the map can be entered or left.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/route/overlay/cost_matrix.h"

namespace relmap::route {

// One label for each frame, in one block of memory.
class Labels {
 public:
  explicit Labels(std::size_t nodes);

  std::span<double> cost;         // of the cheapest path so far
  std::span<double> pending;      // the cost while its links have not been followed yet; otherwise kUnreachable
  std::span<std::uint64_t> came;  // the node before on the path; undefined while there is no path
  std::span<std::uint8_t> settled;
  double min_pending = kUnreachable;

 private:
  std::unique_ptr<std::uint8_t[]> block_;
};

// Relaxes a row of a SplitCostMatrix from a node with this cost: labels that become cheaper are updated and pend, with
// `from` as the node before. Returns the minimum of cost + other[j] over the updated labels, where `other` is the
// remaining cost; kUnreachable if none was updated.
double relax_row(const float* floors, const std::uint16_t* rests, double cost, std::uint64_t from, const double* other,
                 Labels& labels);

// Moves the nodes that pend at a cost of at most `until` to `nodes`, ascending; they no longer pend. Updates
// min_pending.
void take_pending(double until, Labels& labels, std::vector<std::uint32_t>& nodes);

}  // namespace relmap::route
