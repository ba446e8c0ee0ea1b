// What a MapView is made of. Private to storage.
#pragma once

#include <memory>

#include "storage/engine/engine.h"
#include "storage/map/chunk_cache.h"
#include "storage/map/dirty_table.h"
#include "storage/map/map.h"
#include "storage/map/session_records.h"
#include "storage/memory/view_ledger.h"

namespace relmap::storage {

struct MapView::Impl {
  std::uint64_t version = 0;
  std::shared_ptr<ChunkCache> cache;
  std::shared_ptr<ViewLedger> ledger;
  std::shared_ptr<const EngineSnapshot> snapshot;  // of the last commit
  bool digests_hold = false;                       // its digests are right
  std::shared_ptr<const DirtyTable> dirty;         // on top of it
  std::shared_ptr<const SessionTable> sessions;
  SessionCounts session_counts;
  std::shared_ptr<const LabelChanges> labels;
  std::shared_ptr<const SkippedTable> skipped;
  MapFacts state;
  std::size_t pending_frames = 0;

  ~Impl() { let_go(); }
  void check_alive() const;
  // Null if there is none.
  std::shared_ptr<const Session> session(SessionNumber number) const {
    auto edited = find_session(*sessions, number);
    return edited ? edited : cache->session(*snapshot, number);
  }
  // Releases what the view holds, once nobody reads it any more.
  void let_go() {
    if (!ledger) return;
    dirty.reset();
    ledger->remove(version);
    ledger.reset();
    snapshot.reset();
    sessions.reset();
    labels.reset();
    skipped.reset();
  }
};

}  // namespace relmap::storage
