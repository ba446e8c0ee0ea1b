// Shows the progress of long work: a bar that redraws itself on a terminal; elsewhere a line for each step, and for
// each tenth of a step unless it follows within two seconds. That a step is complete is always shown.
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

  // `total` 0: not known. `unit`: "frames", "bytes", ... An empty step shows nothing.
  void show(const std::string& step, std::uint64_t done, std::uint64_t total, const std::string& unit);
  // Erases the bar, at the end or to make room for other text.
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  void draw(const std::string& amount, std::uint64_t done, std::uint64_t total);

  std::ostream& err_;
  const bool terminal_;
  std::string step_;
  std::uint64_t tenths_ = 0;
  Clock::time_point begun_, shown_;
  bool visible_ = false, complete_ = false;  // complete: shown with all of its total
};

// Whether standard error is a terminal that can move the cursor.
bool is_terminal();

}  // namespace relmap::terminal
