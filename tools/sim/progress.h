// How far a long command has come: a bar that redraws itself on a terminal, a line every tenth otherwise.
#pragma once

#include <chrono>
#include <string>

namespace relmap::sim {

// Writes to standard error. Not thread-safe.
class Progress {
 public:
  Progress(std::string verb, std::string unit, int total);
  void step();

 private:
  using Clock = std::chrono::steady_clock;
  void show();

  std::string verb_, unit_;
  int total_, done_ = 0, tenths_ = 0;
  bool terminal_;
  Clock::time_point begin_, shown_;
};

}  // namespace relmap::sim
