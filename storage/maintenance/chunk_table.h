// The frames that exist, chunk by chunk, and for each chunk the sums by which derived fields are compared with the
// facts. That is some 60 bytes for 64 frames, and all that verify keeps for the whole map.
//
// A sum adds a number drawn from each reference that follows from the facts, and subtracts it for each reference that
// is stored. References agree as sets if the sum is zero (but for one case in 2^64), so one walk over the map in any
// order compares them all. Only where a sum is not zero are the references gathered and compared one by one.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "storage/graph/chunk.h"

namespace relmap::storage {

enum class Derived : std::uint8_t { kIncoming, kObservers, kUnreached, kSupport, kBound, kConsistent, kCarriedBy };
inline constexpr std::size_t kDerivedKinds = 7;

struct ChunkEntry {
  ChunkId id;
  std::uint64_t present = 0;  // bit by slot
  std::array<std::uint64_t, kDerivedKinds> sums{};
  bool has_warm = false;

  std::uint64_t& sum(Derived kind) { return sums[static_cast<std::size_t>(kind)]; }
};

class ChunkTable {
 public:
  void add(ChunkId id, std::uint64_t present) { entries_.push_back({id, present, {}, false}); }  // ascending
  std::vector<ChunkEntry>& entries() { return entries_; }
  const std::vector<ChunkEntry>& entries() const { return entries_; }

  ChunkEntry* find(ChunkId id) {
    if (last_ < entries_.size() && entries_[last_].id == id) return &entries_[last_];
    const auto at = std::lower_bound(entries_.begin(), entries_.end(), id,
                                     [](const ChunkEntry& entry, ChunkId key) { return entry.id < key; });
    if (at == entries_.end() || at->id != id) return nullptr;
    last_ = static_cast<std::size_t>(at - entries_.begin());
    return &*at;
  }
  bool has(FrameId frame) {
    const ChunkEntry* entry = frame.valid() ? find(chunk_id(frame)) : nullptr;
    return entry && ((entry->present >> slot_of(frame)) & 1);
  }
  std::size_t bytes() const { return entries_.capacity() * sizeof(ChunkEntry); }

 private:
  std::vector<ChunkEntry> entries_;
  std::size_t last_ = 0;  // found last; the next one is most often the same
};

}  // namespace relmap::storage
