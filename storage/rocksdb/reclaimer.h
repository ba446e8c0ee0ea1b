// Frees the space of what was replaced or deleted. RocksDB's own collection goes by age: every compaction moves the
// values in the oldest quarter of the files, garbage or not. Private to the engine.
//
// Hot and warm parts are replaced all the time: their space is freed when there is enough of it. Pictures, descriptors
// and words are written once; they are deleted with their session, and somebody may count on their being gone. So they
// are off the disk within a day, also from the logs, although all that is kept of the kind is rewritten for that.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <thread>

#include "proto/base/mutex.h"
#include "storage/journal/journal_log.h"
#include "storage/rocksdb/map_database.h"

namespace relmap::storage {

class Reclaimer {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Clock = std::function<Time()>;

  static constexpr std::chrono::hours kDelay{12};      // from the first deletion; a day may have a full disk in it
  static constexpr std::chrono::hours kAfterStart{1};  // if something was deleted before
  static constexpr std::chrono::hours kAgain{1};       // after a failure

  // Works in a thread of its own, unless the map is only read. All must outlive it.
  Reclaimer(const MapDatabase& map, JournalLog& journal, bool read_only, Clock now);
  ~Reclaimer();  // stops what is under way
  Reclaimer(const Reclaimer&) = delete;
  Reclaimer& operator=(const Reclaimer&) = delete;

  // To be called after each commit, with whether it deleted what is written once.
  void look(bool deleted);

 private:
  bool parts_due() const;
  bool was_deleted() const;
  void work();
  Status forget_deleted();

  const MapDatabase& map_;
  JournalLog& journal_;
  const Clock now_;
  Mutex mutex_;
  ConditionVariable changed_;
  std::uint64_t commits_ RELMAP_GUARDED_BY(mutex_) = 0;
  bool parts_wanted_ RELMAP_GUARDED_BY(mutex_) = false;
  std::optional<Time> forget_at_ RELMAP_GUARDED_BY(mutex_);
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace relmap::storage
