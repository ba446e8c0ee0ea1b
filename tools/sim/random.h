// The random generator for painting and building picture worlds, a stream that is read in order.
#pragma once

#include "tools/sim/random_stream.h"

namespace relmap::sim {

// Copies continue independently.
class Random : public Stream {
 public:
  using Stream::Stream;

  int below(int n) { return static_cast<int>(uniform() * n); }  // 0..n-1
  bool chance(double probability) { return uniform() < probability; }
  double sign() { return chance(0.5) ? 1 : -1; }
};

}  // namespace relmap::sim
