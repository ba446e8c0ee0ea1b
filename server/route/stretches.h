// The stretches of a path along which the robot was carried, as by a lift or a train (Edge::carried_by), and those that
// no sensor measured (is_unmeasured()), where length and course are guesses.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
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
