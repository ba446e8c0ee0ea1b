// Maps frames to places and back. Stored as runs of consecutive frames at consecutive places, 32 bytes each.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "server/place/place_block.h"

namespace relmap::place {

// Const members are thread-safe, the others are not.
class FrameTable {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  std::uint32_t places() const { return by_place_.empty() ? 0 : by_place_.back().place + by_place_.back().count; }

  // Appends places after the last one. `runs` are ascending and number the new places from 0. If one of the frames has
  // a place already, returns false and changes nothing.
  bool append(const std::vector<FrameRun>& runs) {
    const std::uint32_t base = places();
    std::vector<FrameRun> both = by_frame_;
    both.reserve(by_frame_.size() + runs.size());
    for (FrameRun run : runs) {
      run.place += base;
      both.push_back(run);
    }
    const auto middle = both.begin() + static_cast<std::ptrdiff_t>(by_frame_.size());
    std::inplace_merge(both.begin(), middle, both.end(), before);
    for (std::size_t i = 1; i < both.size(); ++i)
      if (both[i - 1].first.packed() + both[i - 1].count > both[i].first.packed()) return false;
    for (FrameRun run : runs) {
      run.place += base;
      by_place_.push_back(run);
    }
    by_frame_ = std::move(both);
    return true;
  }

  // Removes all places from number `places` on.
  void truncate(std::uint32_t places) {
    const auto goes = [places](const FrameRun& run) { return run.place >= places; };
    std::erase_if(by_place_, goes);
    std::erase_if(by_frame_, goes);
  }

  // The place of a frame, or kNone.
  std::uint32_t find(FrameId frame) const {
    const auto after = std::upper_bound(by_frame_.begin(), by_frame_.end(), FrameRun{frame, 0, 0}, before);
    if (after == by_frame_.begin() || !std::prev(after)->contains(frame)) return kNone;
    return std::prev(after)->place + (frame.index - std::prev(after)->first.index);
  }
  FrameId frame(std::uint32_t place) const {
    const auto after = std::upper_bound(by_place_.begin(), by_place_.end(), place,
                                        [](std::uint32_t p, const FrameRun& run) { return p < run.place; });
    const FrameRun& run = *std::prev(after);
    return {run.first.session, run.first.index + (place - run.place)};
  }
  const std::vector<FrameRun>& by_frame() const { return by_frame_; }

  std::size_t memory_bytes() const { return (by_frame_.capacity() + by_place_.capacity()) * sizeof(FrameRun); }

 private:
  static bool before(const FrameRun& x, const FrameRun& y) { return x.first < y.first; }

  std::vector<FrameRun> by_frame_, by_place_;
};

}  // namespace relmap::place
