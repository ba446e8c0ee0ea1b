#include "server/route/carried.h"

#include <algorithm>

namespace relmap {

void CarriedStretches::add(FrameId a, FrameId b, const std::vector<EdgeId>& carried_by) {
  if (carried_by.empty()) return;
  if (!list_.empty() && list_.back().last == a) {
    list_.back().last = b;
  } else if (!list_.empty() && list_.back().first == b) {
    list_.back().first = a;
  } else if (list_.size() < kMost) {
    list_.push_back({a, b, {}});
  } else {
    return;
  }
  std::vector<EdgeId>& named = list_.back().closures;
  named.insert(named.end(), carried_by.begin(), carried_by.end());
  std::sort(named.begin(), named.end());
  named.erase(std::unique(named.begin(), named.end()), named.end());
  if (named.size() > CarriedStretch::kMostNamed) named.resize(CarriedStretch::kMostNamed);
}

void CarriedStretches::reverse() { std::reverse(list_.begin(), list_.end()); }

}  // namespace relmap
