// Makes the words of a map anew from its features, with another vocabulary. Nothing else changes.
#pragma once

#include <cstdint>
#include <memory>

#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/graph/frame.h"
#include "storage/maintenance/finding.h"

namespace relmap::storage {

struct ReindexSummary {
  bool changed = false;      // false: the words are this vocabulary's already, or there are no frames yet
  std::uint64_t frames = 0;  // of the map
  std::uint64_t with_words = 0;
  std::uint64_t without_appearance = 0;  // no features are stored, so there are no words
  std::uint64_t unreadable = 0;          // their features are damaged: they have no words now, until a repair
  std::uint32_t former_crc = 0;          // the vocabulary before; 0: none, or a reindex was interrupted
};

// For a map that no daemon works on: takes the engine over, and leaves it committed. The first commit says that the
// words are of no vocabulary, which every daemon refuses. Then follow the chunks, one by one; the last commit says
// which vocabulary the words are of. So if it is interrupted at any point, the map is whole but for its words, and
// reindex can be run again with any vocabulary. Records of the journal behind the last commit have no words yet. Holds
// the features of one chunk in memory, and works with as many threads as there are processors. IO_ERROR, DISK_FULL,
// STALE_OWNER; DATA_LOSS if sessions or state cannot be read (nothing is changed then); SHUTTING_DOWN if `on_progress`
// said so.
Result<ReindexSummary> reindex(const std::shared_ptr<Engine>& engine, const WordFunction& words,
                               std::uint32_t vocabulary_crc, const OnFinding& on_finding,
                               const OnProgress& on_progress);

}  // namespace relmap::storage
