#include "storage/engine/memory_engine.h"

#include <deque>

#include "proto/base/mutex.h"
#include "storage/engine/table_snapshot.h"

namespace relmap::storage {
namespace {

class MemoryEngine final : public Engine {
 public:
  Result<std::uint64_t> acquire() override {
    const MutexLock lock(mutex_);
    return ++epoch_;
  }

  Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) override {
    const MutexLock lock(mutex_);
    if (Status owner = check_owner(epoch); !owner.ok()) return owner;
    for (const Bytes& record : records) journal_.push_back(std::make_shared<const Bytes>(record));
    return first_ + journal_.size() - 1;
  }

  Status read_journal(std::uint64_t from,
                      const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const override {
    for (std::uint64_t sequence = from;; ++sequence) {
      std::shared_ptr<const Bytes> record;
      {
        const MutexLock lock(mutex_);
        if (sequence < first_) sequence = first_;
        if (sequence - first_ >= journal_.size()) return {};
        record = journal_[sequence - first_];
      }
      if (!visit(sequence, *record)) return {};
    }
  }

  std::uint64_t first_journal_sequence() const override {
    const MutexLock lock(mutex_);
    return first_;
  }

  std::uint64_t last_journal_sequence() const override {
    const MutexLock lock(mutex_);
    return first_ + journal_.size() - 1;
  }

  Status trim(std::uint64_t through) override {
    const MutexLock lock(mutex_);
    for (; first_ <= through && !journal_.empty(); ++first_) journal_.pop_front();
    return {};
  }

  Status commit(std::uint64_t epoch, std::uint64_t applied_sequence, std::span<const Put> puts,
                std::span<const std::string> deletes) override {
    const MutexLock lock(mutex_);
    if (Status owner = check_owner(epoch); !owner.ok()) return owner;
    if (applied_sequence < applied_)
      return Status(Reason::INVALID_ARGUMENT, "a commit of journal sequence " + std::to_string(applied_sequence) +
                                                  " after one of " + std::to_string(applied_));
    table_ = TableSnapshot::changed(*table_, puts, deletes);
    applied_ = applied_sequence;
    ++commits_;
    return {};
  }

  std::uint64_t applied_sequence() const override {
    const MutexLock lock(mutex_);
    return applied_;
  }

  std::shared_ptr<const EngineSnapshot> snapshot() const override {
    const MutexLock lock(mutex_);
    return std::make_shared<TableSnapshot>(table_, commits_);
  }

  Result<SessionNumber> allocate_session(std::uint64_t epoch, SessionNumber skipped) override {
    const MutexLock lock(mutex_);
    if (Status owner = check_owner(epoch); !owner.ok()) return owner;
    const auto next = next_session(session_, skipped);
    if (next.ok()) session_ = *next;
    return next;
  }

  Status checkpoint(const NewFolder&, const EngineProgress&) override {
    return Status(Reason::UNSUPPORTED, "the memory engine keeps nothing that could be copied to a folder");
  }
  Status compact(const EngineProgress&) override { return {}; }  // a table holds no replaced values

  Result<EngineStats> stats() const override {
    const MutexLock lock(mutex_);
    EngineStats stats;
    stats.map_bytes = TableSnapshot::bytes(*table_);
    stats.journal_records = journal_.size();
    for (const auto& record : journal_) stats.journal_bytes += record->size();
    return stats;
  }

  // It stands in for a disk, so its content does not count as the daemon's memory.
  std::size_t memory_bytes() const override { return 0; }

 private:
  Status check_owner(std::uint64_t epoch) const RELMAP_REQUIRES(mutex_) {
    if (epoch == epoch_) return {};
    return Status(Reason::STALE_OWNER,
                  "epoch " + std::to_string(epoch) + ", the map is owned by " + std::to_string(epoch_));
  }

  mutable Mutex mutex_;
  std::uint64_t epoch_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::uint64_t first_ RELMAP_GUARDED_BY(mutex_) = 1;
  std::deque<std::shared_ptr<const Bytes>> journal_ RELMAP_GUARDED_BY(mutex_);
  std::shared_ptr<const Table> table_ RELMAP_GUARDED_BY(mutex_) = std::make_shared<Table>();
  std::uint64_t applied_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::uint64_t commits_ RELMAP_GUARDED_BY(mutex_) = 0;
  SessionNumber session_ RELMAP_GUARDED_BY(mutex_) = 0;
};

}  // namespace

std::shared_ptr<Engine> make_memory_engine() { return std::make_shared<MemoryEngine>(); }

}  // namespace relmap::storage
