// Durable records that wait for the worker. Threads decode the keyframes that are next, and find their words, while the
// worker is at others, so that it does only what needs the map. Records leave in the order in which they came.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "proto/base/mutex.h"
#include "server/map/journal_writer.h"
#include "server/map/prepared_keyframe.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// Beyond this robots wait: the worker is behind by so much, and a start after a crash has to do all of it again.
inline constexpr std::chrono::seconds kMaxWorkerLag{1};

// Thread-safe; one thread takes.
class RecordQueue {
 public:
  struct Next {
    DurableRecord durable;
    std::optional<PreparedKeyframe> prepared;  // of a keyframe that a thread has prepared
  };

  // `threads` that prepare, or as many of them as can be started.
  RecordQueue(storage::WordFunction words, std::shared_ptr<storage::Budget> budget, std::size_t threads);
  ~RecordQueue();
  RecordQueue(const RecordQueue&) = delete;
  RecordQueue& operator=(const RecordQueue&) = delete;

  void push(std::vector<DurableRecord> group);
  bool empty() const { return size() == 0; }
  std::size_t size() const;
  // For how many seconds the first record has waited for the worker; 0 if none waits.
  double lag_s() const;
  // Takes the first record; there must be one. Waits for a thread that is preparing it, but for none to begin.
  Next take();

 private:
  enum class Stage : std::uint8_t { kWaits, kInWork, kReady };
  struct Entry {
    Next next;
    Stage stage = Stage::kWaits;
    std::chrono::steady_clock::time_point pushed;
  };

  void run();
  Entry* first_waiting() RELMAP_REQUIRES(mutex_);
  void prepare_entry(Entry& entry) RELMAP_REQUIRES(mutex_);

  const storage::WordFunction words_;
  const std::shared_ptr<storage::Budget> budget_;  // a prepared keyframe is charged as much as its record
  const std::size_t max_ahead_;                    // entries that may be in work or ready
  mutable Mutex mutex_;
  ConditionVariable changed_;
  std::deque<Entry> entries_ RELMAP_GUARDED_BY(mutex_);  // a deque, whose entries stay in place
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace relmap::map
