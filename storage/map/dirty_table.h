// What is dirty since the last commit, as a view holds it: immutable, and shared by views as far as nothing has changed
// between them.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/graph/chunk.h"

namespace relmap::storage {

// The dirty frames of one chunk; null: not dirty.
struct DirtyChunk {
  Slots<FrameHot> hot;
  Slots<FrameWarm> warm;
  Slots<FrameCold> cold;
  bool removed = false;  // the committed chunk is not in the map any more
};

// Dirty chunks, ascending. Publishing copies this table (some dozens of pointers) and the chunks edited since.
using DirtyTable = std::vector<std::pair<ChunkId, std::shared_ptr<const DirtyChunk>>>;

inline const DirtyChunk* find_dirty(const DirtyTable& table, ChunkId id) {
  const auto it = std::lower_bound(table.begin(), table.end(), id,
                                   [](const auto& entry, const ChunkId& key) { return entry.first < key; });
  return it != table.end() && it->first == id ? it->second.get() : nullptr;
}

// Labels set (true) and removed (false) since the last commit.
using LabelChanges = std::map<std::pair<std::string, FrameId>, bool>;

// Sequences that were skipped since the last commit, by session and last sequence; nullopt: a committed record of them
// that has been removed since.
using SkippedTable = std::map<std::pair<SessionNumber, std::uint32_t>, std::optional<Skipped>>;

}  // namespace relmap::storage
