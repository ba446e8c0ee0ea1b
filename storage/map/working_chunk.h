// The worker's own copies of what is dirty. Private to storage.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "storage/graph/chunk.h"

namespace relmap::storage {

template <typename Frame>
struct WorkingPart {
  std::array<std::shared_ptr<Frame>, kFramesPerChunk> frames;  // null: not dirty
  std::uint64_t fresh = 0;                                     // bit by slot: cloned or added since the last publish
  std::array<std::uint64_t, kFramesPerChunk> since{};          // version that first showed this copy
  std::array<std::size_t, kFramesPerChunk> bytes{};            // charged as dirty

  bool is_fresh(std::uint32_t slot) const { return (fresh >> slot) & 1; }
  void set(std::uint32_t slot, std::shared_ptr<Frame> frame) {
    frames[slot] = std::move(frame);
    fresh |= std::uint64_t{1} << slot;
  }
};

struct WorkingChunk {
  WorkingPart<FrameHot> hot;
  WorkingPart<FrameWarm> warm;
  WorkingPart<FrameCold> cold;
  bool touched = false;  // since the last publish
  bool removed = false;  // the committed chunk is not in the map any more

  template <typename Frame>
  const WorkingPart<Frame>& part() const {
    if constexpr (std::is_same_v<Frame, FrameHot>)
      return hot;
    else if constexpr (std::is_same_v<Frame, FrameWarm>)
      return warm;
    else
      return cold;
  }
};

}  // namespace relmap::storage
