// The stretches of a path that follow edges of one kind.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "storage/graph/frame.h"

namespace relmap::route {

// Collects stretches of a path whose edges are added in order, from either end. A Stretch has the frames `first` and
// `last` of one session, in the order in which it drove. At most kMax stretches are kept.
template <typename Stretch>
class Stretches {
 public:
  static constexpr std::size_t kMax = 256;

  void reverse() { std::reverse(list_.begin(), list_.end()); }
  const std::vector<Stretch>& list() const { return list_; }

 protected:
  // The stretch that the edge from a to b extends or begins; null if it would begin one too many.
  Stretch* extend(FrameId a, FrameId b) {
    if (!list_.empty() && list_.back().last == a) {
      list_.back().last = b;
    } else if (!list_.empty() && list_.back().first == b) {
      list_.back().first = a;
    } else if (list_.size() < kMax) {
      list_.push_back({.first = a, .last = b});
    } else {
      return nullptr;
    }
    return &list_.back();
  }

 private:
  std::vector<Stretch> list_;
};

}  // namespace relmap::route
