// The journal's only writer: group commit without timers. Whatever queues while one append is being made durable goes
// into the next. After an append that failed nothing is taken until the journal says that it would be, which is asked
// five times a second: the caller keeps what it has, and order is kept.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/journal/journal_record.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// A record with its place in the journal. `bytes` stay charged to Share::kQueues until release().
struct DurableRecord {
  std::uint64_t sequence = 0;
  storage::JournalRecord record;
  std::size_t bytes = 0;
};

// Thread-safe.
class JournalWriter {
 public:
  using Done = std::function<void(const Result<std::uint64_t>&)>;
  // Called from the writer's thread with each durable group, in order, before their `done`.
  using OnDurable = std::function<void(std::vector<DurableRecord>)>;

  // `one_at_a_time`: groups of one record, the next only after settled(sequence) of the one before (deterministic
  // mode).
  JournalWriter(std::shared_ptr<storage::Engine> engine, std::uint64_t epoch, std::shared_ptr<storage::Budget> budget,
                bool one_at_a_time, OnDurable on_durable);
  ~JournalWriter();

  // BUDGET_EXCEEDED: the queue is full; SHUTTING_DOWN; what health() says. Otherwise `done` is called once, from the
  // writer's thread: records become durable in the order in which they were submitted, or not at all.
  Status submit(storage::JournalRecord record, Done done);

  // Everything that follows from record `sequence` has been applied; deterministic mode only.
  void settled(std::uint64_t sequence);
  // Appends at once, from the worker, between a group and its settled(); deterministic mode only.
  Result<std::uint64_t> append_follow_up(const storage::JournalRecord& record);

  std::uint64_t durable_through() const;
  bool idle() const;      // nothing queued, nothing being written
  Status health() const;  // not ok: why nothing is taken now

  // Writes what is queued, then ends the thread.
  void stop();

 private:
  struct Queued {
    storage::JournalRecord record;
    Done done;
    std::size_t bytes;
  };
  void run();
  void write(std::vector<Queued> group);
  Result<std::uint64_t> append(std::span<const Queued> group);
  void refuse(std::vector<Queued> group, const Status& why);
  void set_health(const Status& status);

  const std::shared_ptr<storage::Engine> engine_;
  const std::uint64_t epoch_;
  const std::shared_ptr<storage::Budget> budget_;
  const bool one_at_a_time_;
  const OnDurable on_durable_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Queued> queue_;
  bool writing_ = false;
  bool stopping_ = false;
  std::uint64_t durable_ = 0;
  std::uint64_t settled_ = 0;
  Status health_;
  std::thread thread_;
};

}  // namespace relmap::map
