// Consecutive frames of a session.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "proto/base/ids.h"

namespace relmap::storage {

struct FrameRange {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = 0;  // inclusive

  bool operator==(const FrameRange&) const = default;
  bool contains(FrameId frame) const { return frame.session == session && frame.index >= first && frame.index <= last; }
};

inline bool within(FrameId frame, std::span<const FrameRange> ranges) {
  return std::any_of(ranges.begin(), ranges.end(), [&](const FrameRange& range) { return range.contains(frame); });
}

}  // namespace relmap::storage
