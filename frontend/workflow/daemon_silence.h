// The lines that tell the user when the daemon does not answer, and when it answers again.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "proto/base/status.h"

namespace relmap::workflow {

// Whether the daemon answers, and takes nothing with these credentials: waiting alone does not help.
bool is_refusal(const Status& trouble);

// Returns "WHAT on DAEMON (TROUBLE)", without the brackets if `trouble` is ok.
std::string silence_of(const std::string& daemon, const std::string& what, const Status& trouble);

// Reports once that the daemon has been silent for longer than `patience`, and once that it answers again. A daemon
// that serves another map than that of a live session is reported without this delay, since waiting does not help.
// Callers pass the time, so that tests can choose it. Not thread-safe.
class DaemonSilence {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct Options {
    std::string daemon;   // its address, for the messages
    std::string kept_in;  // folder where keyframes wait; empty if they wait in memory
    bool live = false;    // the source cannot be read again
    std::chrono::milliseconds patience{5000};
  };
  // The daemon counts as silent since `begin`.
  DaemonSilence(Options options, Time begin);

  // Returns a line for the user if there is something new to report. `heard` says that the daemon has answered at least
  // once; `trouble` is KeyframeSink::trouble().
  std::optional<std::string> look(Time now, bool heard, const Status& trouble);

 private:
  const Options options_;
  std::optional<Time> silent_since_;
  bool told_ = false;
};

}  // namespace relmap::workflow
