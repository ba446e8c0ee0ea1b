#include "server/route/stretches.h"

#include <algorithm>

#include "server/route/weight.h"

namespace relmap::route {

void CarriedStretches::add(FrameId a, FrameId b, const std::vector<EdgeId>& carried_by) {
  if (carried_by.empty()) return;
  CarriedStretch* const stretch = extend(a, b);
  if (!stretch) return;
  std::vector<EdgeId>& named = stretch->closures;
  named.insert(named.end(), carried_by.begin(), carried_by.end());
  std::sort(named.begin(), named.end());
  named.erase(std::unique(named.begin(), named.end()), named.end());
  if (named.size() > CarriedStretch::kMaxNamed) named.resize(CarriedStretch::kMaxNamed);
}

void UnmeasuredStretches::add(const storage::Edge& edge) {
  if (!storage::is_unmeasured(edge)) return;
  ++steps_;
  distance_m_ += length_m(edge);
  UnmeasuredStretch* const stretch = extend(edge.a, edge.b);
  if (!stretch) return;
  ++stretch->steps;
  stretch->distance_m += length_m(edge);
}

}  // namespace relmap::route
