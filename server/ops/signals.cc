#include "server/ops/signals.h"

#include <csignal>
#include <ctime>

namespace relmap::ops {

namespace {

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  return set;
}

sigset_t all_signals() {
  sigset_t set = stop_signals();
  sigaddset(&set, SIGHUP);
  return set;
}

}  // namespace

void block_stop_signals() {
  const sigset_t set = all_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

bool is_told_to_stop() {
  sigset_t pending;
  sigemptyset(&pending);
  sigpending(&pending);
  return sigismember(&pending, SIGTERM) == 1 || sigismember(&pending, SIGINT) == 1;
}

std::optional<int> wait_for_signal(std::chrono::milliseconds timeout) {
  const sigset_t set = all_signals(), stop = stop_signals();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(timeout);
  const std::chrono::nanoseconds rest = timeout - seconds;
  const timespec patience{static_cast<time_t>(seconds.count()), static_cast<long>(rest.count())};
  const int signal = sigtimedwait(&set, nullptr, &patience);
  if (signal < 0) return std::nullopt;
  if (signal != SIGHUP) pthread_sigmask(SIG_UNBLOCK, &stop, nullptr);
  return signal;
}

}  // namespace relmap::ops
