// The deadline of a call, and whether its caller still waits.
#pragma once

#include <chrono>
#include <functional>

#include "proto/base/status.h"

namespace relmap::rpc {

struct Deadline {
  std::chrono::steady_clock::time_point at = std::chrono::steady_clock::time_point::max();
  std::function<Status()> interrupted;  // not ok if the caller has gone or the daemon stops; may be empty

  // DEADLINE once the deadline has passed, or what `interrupted` returns.
  Status check() const {
    if (interrupted)
      if (Status status = interrupted(); !status.ok()) return status;
    if (std::chrono::steady_clock::now() >= at) return {Reason::DEADLINE, "the deadline has passed"};
    return {};
  }
};

}  // namespace relmap::rpc
