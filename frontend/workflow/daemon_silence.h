// What there is to tell people while no daemon takes what a run sends.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "proto/base/status.h"

namespace relmap::workflow {

// "WHAT on DAEMON", and why, where that is known.
std::string silence_of(const std::string& daemon, const std::string& what, const Status& trouble);

// A daemon that is silent for long is told of once, and so is that it answers again. What is wrong for good, the map of
// a live source's session, is told of at once. Time is an argument. Not thread-safe.
class DaemonSilence {
 public:
  using Time = std::chrono::steady_clock::time_point;

  struct Options {
    std::string daemon;   // where it is looked for
    std::string kept_in;  // folder where keyframes wait; empty: in memory
    bool live = false;    // the source cannot be read again
    std::chrono::milliseconds patience{5000};
  };
  // Nothing has been heard since `begin`.
  DaemonSilence(Options options, Time begin);

  // `heard`: it has answered at least once. A line for people, if there is one to be said now.
  std::optional<std::string> look(Time now, bool heard, const Status& trouble);

 private:
  const Options options_;
  std::optional<Time> silent_since_;
  bool told_ = false;
};

}  // namespace relmap::workflow
