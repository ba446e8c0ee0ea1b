#include "server/route/carried.h"

#include <algorithm>

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

}  // namespace relmap::route
