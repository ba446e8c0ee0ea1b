#include "tools/sim/progress.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace relmap::sim {

Progress::Progress(std::string verb, std::string unit, int total)
    : verb_(std::move(verb)),
      unit_(std::move(unit)),
      total_(total),
      terminal_(isatty(STDERR_FILENO) != 0),
      begin_(Clock::now()),
      shown_(begin_) {}

void Progress::step() {
  ++done_;
  const auto now = Clock::now();
  if (terminal_ ? done_ == total_ || now - shown_ > std::chrono::milliseconds(100) : done_ * 10LL / total_ > tenths_) {
    tenths_ = static_cast<int>(done_ * 10LL / total_);
    shown_ = now;
    show();
  }
}

void Progress::show() {
  const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
  const double rate = done_ / (seconds > 0 ? seconds : 1e-9);
  if (!terminal_) {
    std::fprintf(stderr, "%s: %d of %d %s, %.1f s\n", verb_.c_str(), done_, total_, unit_.c_str(), seconds);
    return;
  }
  constexpr int kWidth = 32;
  const auto full = static_cast<int>(static_cast<long long>(done_) * kWidth / total_);
  std::string bar(full, '#');
  bar.append(kWidth - full, '.');
  std::fprintf(stderr, "\r%s [%s] %d/%d %s  %.1f/s  %.0f s left \x1b[K%s", verb_.c_str(), bar.c_str(), done_, total_,
               unit_.c_str(), rate, (total_ - done_) / rate, done_ == total_ ? "\n" : "");
}

}  // namespace relmap::sim
