// The journal's only writer: group commit without timers. Records that queue while one append is being made durable go
// into the next. After an append has failed, the queue is refused and nothing is taken until the engine, which is asked
// five times a second, would take records again. So callers keep what was refused, and no record overtakes another.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "proto/base/busy_since.h"
#include "proto/base/duration_histogram.h"
#include "proto/base/mutex.h"
#include "storage/engine/engine.h"
#include "storage/journal/journal_record.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// A record with its sequence in the journal. Its receiver releases `bytes`, which are charged to Share::kQueues.
struct DurableRecord {
  std::uint64_t sequence = 0;
  storage::JournalRecord record;
  std::size_t bytes = 0;
};

// Sets when the record was submitted to now, unless it says so or cannot.
void stamp(storage::JournalRecord& record);

// Thread-safe.
class JournalWriter {
 public:
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  // Called from the writer's thread with each durable group, in order, before their `done`.
  using OnDurable = std::function<void(std::vector<DurableRecord>)>;
  // Called from the writer's thread, without a lock held, when idle() may have become true.
  using OnIdle = std::function<void()>;

  // `one_at_a_time` (deterministic mode): writes groups of one record, each only after finished() of the one before;
  // the first after finished() of the last record that the journal has.
  JournalWriter(std::shared_ptr<storage::Engine> engine, std::uint64_t epoch, std::shared_ptr<storage::Budget> budget,
                bool one_at_a_time, OnDurable on_durable, OnIdle on_idle);
  ~JournalWriter();

  // Queues a record, stamped. BUDGET_EXCEEDED if the queue is full, SHUTTING_DOWN, or health(); otherwise `done` is
  // called once, from the writer's thread. Records become durable in the order in which they were submitted, or not at
  // all.
  Status submit(storage::JournalRecord record, Done done);

  // Deterministic mode: tells that record `sequence` and everything that follows from it has been applied.
  void finished(std::uint64_t sequence);
  // Deterministic mode: appends at once, from the worker, between a group and its finished().
  Result<std::uint64_t> append_follow_up(const storage::JournalRecord& record);

  std::uint64_t durable_through() const;
  std::size_t waiting() const;  // records queued or being written, not durable yet
  bool idle() const;            // nothing queued, nothing being written, and everybody told
  Status health() const;        // not ok: why nothing is taken now

  // Seconds that the append has taken so far which the engine is at; 0: none is.
  double busy_s() const { return busy_.seconds(); }
  // How long appends have taken, and how long keyframes from submit() until they were durable.
  DurationCounts appends() const { return appends_.counts(); }
  DurationCounts acknowledgements() const { return acknowledgements_.counts(); }

  // Writes what is queued, then ends the thread.
  void stop();

 private:
  struct Queued {
    storage::JournalRecord record;
    Done done;
    std::size_t bytes;
    std::chrono::steady_clock::time_point submitted;
  };
  void run();
  void write(std::vector<Queued> group);
  Result<std::uint64_t> append(std::span<const Queued> group);
  Result<std::uint64_t> append_to_engine(std::span<const Bytes> records);
  void refuse(std::vector<Queued> group, const Status& why);
  void set_health(const Status& status) RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<storage::Engine> engine_;
  const std::uint64_t epoch_;
  const std::shared_ptr<storage::Budget> budget_;
  const bool one_at_a_time_;
  const OnDurable on_durable_;
  const OnIdle on_idle_;

  BusySince busy_;
  DurationHistogram appends_, acknowledgements_;

  mutable Mutex mutex_;
  ConditionVariable wake_;
  std::vector<Queued> queue_ RELMAP_GUARDED_BY(mutex_);
  bool writing_ RELMAP_GUARDED_BY(mutex_) = false;
  std::size_t in_group_ RELMAP_GUARDED_BY(mutex_) = 0;  // records being written
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::uint64_t durable_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::uint64_t finished_ RELMAP_GUARDED_BY(mutex_) = 0;
  Status health_ RELMAP_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace relmap::map
