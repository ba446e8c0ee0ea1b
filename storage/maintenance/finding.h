// What verify finds and repair mends, and how both report it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "proto/base/ids.h"
#include "proto/base/reason.h"

namespace relmap::storage {

struct Finding {
  Reason reason = Reason::OK;  // DATA_LOSS: it cannot be read. CORRUPT: it is whole, and cannot be right
  FrameId frame;               // the frame affected; invalid: none in particular
  std::string what;            // in words, with the part, edge or landmark affected
  bool repaired = false;
};

struct MaintenanceProgress {
  std::string step;
  std::uint64_t done = 0, total = 0;  // total 0: not known
  std::string unit;                   // of `done` and `total`: "frames", "records", "keys"
};

// Both are called from the thread that verifies or repairs, and may be empty.
using OnFinding = std::function<void(const Finding&)>;
using OnProgress = std::function<bool(const MaintenanceProgress&)>;  // false: stop

}  // namespace relmap::storage
