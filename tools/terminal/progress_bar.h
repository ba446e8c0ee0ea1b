// How far long work has come: a bar that redraws itself on a terminal; elsewhere a line at each step, and at each tenth
// of it unless that follows within two seconds.
#pragma once

#include <chrono>
#include <cstdint>
#include <iosfwd>
#include <string>

namespace relmap::terminal {

class ProgressBar {
 public:
  ProgressBar(std::ostream& err, bool terminal) : err_(err), terminal_(terminal) {}
  ~ProgressBar() { end(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `total` 0: not known. `unit`: "frames", "bytes", ... An empty step says nothing.
  void show(const std::string& step, std::uint64_t done, std::uint64_t total, const std::string& unit);
  // Takes the bar away; also to make room for other text.
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  void draw(const std::string& amount, std::uint64_t done, std::uint64_t total);

  std::ostream& err_;
  const bool terminal_;
  std::string step_;
  std::uint64_t tenths_ = 0;
  Clock::time_point begun_, shown_;
  bool visible_ = false;
};

// Standard error is one, and it is able to move the cursor.
bool is_terminal();

}  // namespace relmap::terminal
