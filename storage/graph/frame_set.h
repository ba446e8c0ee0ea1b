// A set of frames, as one bit each in a mask for their chunk. Remembers which chunks changed, for the next commit.
#pragma once

#include <bit>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "storage/graph/chunk.h"

namespace relmap::storage {

class FrameSet {
 public:
  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  std::size_t memory_bytes() const { return (chunks_.size() + changed_.size()) * kNodeBytes; }

  void insert(FrameId id) {
    const std::uint64_t was = chunk(chunk_id(id));
    set_chunk(chunk_id(id), was | bit(id));
  }
  void erase(FrameId id) {
    const std::uint64_t was = chunk(chunk_id(id));
    set_chunk(chunk_id(id), was & ~bit(id));
  }
  bool contains(FrameId id) const { return (chunk(chunk_id(id)) & bit(id)) != 0; }
  // The set must not be empty.
  FrameId first() const {
    return frame_in(chunks_.begin()->first, static_cast<std::uint32_t>(std::countr_zero(chunks_.begin()->second)));
  }

  // The frames of a chunk, one bit for each slot.
  std::uint64_t chunk(ChunkId id) const {
    const auto found = chunks_.find(id);
    return found == chunks_.end() ? 0 : found->second;
  }
  void set_chunk(ChunkId id, std::uint64_t frames) {
    const std::uint64_t was = chunk(id);
    if (frames == was) return;
    size_ = size_ + static_cast<std::size_t>(std::popcount(frames)) - static_cast<std::size_t>(std::popcount(was));
    if (frames == 0)
      chunks_.erase(id);
    else
      chunks_[id] = frames;
    changed_.insert(id);
  }
  const std::map<ChunkId, std::uint64_t>& chunks() const { return chunks_; }

  const std::set<ChunkId>& changed() const { return changed_; }
  std::set<ChunkId> take_changes() { return std::exchange(changed_, {}); }
  void add_changes(const std::set<ChunkId>& chunks) { changed_.insert(chunks.begin(), chunks.end()); }

  bool operator==(const FrameSet& other) const { return chunks_ == other.chunks_; }

 private:
  static constexpr std::size_t kNodeBytes = 64;  // a node of a tree, about

  static std::uint64_t bit(FrameId id) { return std::uint64_t{1} << slot_of(id); }

  std::map<ChunkId, std::uint64_t> chunks_;  // no mask is 0
  std::set<ChunkId> changed_;
  std::size_t size_ = 0;
};

}  // namespace relmap::storage
