// Consecutive frames of a session.
#pragma once

#include <cstdint>

#include "proto/ids.h"

namespace relmap {

struct FrameRange {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = 0;  // both within

  bool operator==(const FrameRange&) const = default;
  bool contains(FrameId frame) const { return frame.session == session && frame.index >= first && frame.index <= last; }
};

}  // namespace relmap
