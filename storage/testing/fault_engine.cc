#include "storage/testing/fault_engine.h"

#include "storage/engine/table_snapshot.h"
#include "storage/format/codec.h"
#include "storage/journal/journal_log.h"

namespace relmap::storage {
namespace {

constexpr std::uint64_t kSegmentBytes = 16 * 1024;  // small, so that tests see many segments

bool fails(std::atomic<int>& left) {
  int now = left.load();
  while (now > 0)
    if (left.compare_exchange_weak(now, now - 1)) return true;
  return false;
}

Status told_to(const char* what) { return Status(Reason::IO_ERROR, std::string(what) + " failed, as it was told to"); }

class FaultSnapshot final : public EngineSnapshot {
 public:
  FaultSnapshot(TableSnapshot table, std::shared_ptr<Faults> faults)
      : table_(std::move(table)), faults_(std::move(faults)) {}
  std::uint64_t commit_number() const override { return table_.commit_number(); }
  Result<std::optional<Bytes>> get(std::string_view key) const override {
    if (fails(faults_->reads)) return told_to("a read");
    return table_.get(key);
  }
  Status scan_from(std::string_view prefix, std::string_view from, const Visit& visit) const override {
    if (fails(faults_->reads)) return told_to("a read");
    return table_.scan_from(prefix, from, visit);
  }

 private:
  const TableSnapshot table_;
  const std::shared_ptr<Faults> faults_;
};

// What the engine stores besides the journal, and the record of each change to it.
struct Root {
  std::uint64_t epoch = 0;
  std::uint64_t applied = 0;
  std::uint64_t commits = 0;
  SessionNumber session = 0;
  std::shared_ptr<const Table> table = std::make_shared<const Table>();
};

struct Change {
  Root root;  // all of it but the table
  std::vector<Put> puts;
  std::vector<std::string> deletes;
};

Bytes encode(const Root& root, std::span<const Put> puts, std::span<const std::string> deletes) {
  ByteWriter w;
  w.put(root.epoch);
  w.put(root.applied);
  w.put(root.commits);
  w.put(root.session);
  w.put(static_cast<std::uint32_t>(puts.size()));
  for (const Put& put : puts) {
    codec::put_long_string(w, put.key);
    codec::put_blob(w, put.value);
  }
  w.put(static_cast<std::uint32_t>(deletes.size()));
  for (const std::string& key : deletes) codec::put_long_string(w, key);
  return w.take();
}

Change decode(ByteSpan bytes) {
  ByteReader r(bytes);
  Change change;
  change.root.epoch = r.get<std::uint64_t>();
  change.root.applied = r.get<std::uint64_t>();
  change.root.commits = r.get<std::uint64_t>();
  change.root.session = r.get<SessionNumber>();
  for (auto n = r.get<std::uint32_t>(); r.ok() && n > 0; --n) {
    Put put;
    put.key = codec::get_long_string(r);
    put.value = codec::get_blob(r);
    change.puts.push_back(std::move(put));
  }
  for (auto n = r.get<std::uint32_t>(); r.ok() && n > 0; --n) change.deletes.push_back(codec::get_long_string(r));
  return change;
}

class FaultEngine final : public Engine {
 public:
  FaultEngine(std::shared_ptr<Faults> faults, std::unique_ptr<JournalLog> commits, std::unique_ptr<JournalLog> journal,
              Root root)
      : faults_(std::move(faults)),
        commits_(std::move(commits)),
        journal_(std::move(journal)),
        root_(std::move(root)) {}

  Result<std::uint64_t> acquire() override {
    const std::lock_guard lock(mutex_);
    Root next = root_;
    ++next.epoch;
    if (Status status = write(std::move(next), {}, {}); !status.ok()) return status;
    return root_.epoch;
  }

  Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) override {
    const std::lock_guard lock(mutex_);
    if (Status owner = check_owner(epoch); !owner.ok()) return owner;
    if (fails(faults_->appends)) return told_to("an append");
    return journal_->append(records);
  }

  Status read_journal(std::uint64_t from,
                      const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const override {
    return journal_->read(from, visit);
  }
  std::uint64_t first_journal_sequence() const override { return journal_->first(); }
  std::uint64_t last_journal_sequence() const override { return journal_->last(); }
  Status trim(std::uint64_t through) override { return journal_->trim(through); }

  Status commit(std::uint64_t epoch, std::uint64_t applied_sequence, std::span<const Put> puts,
                std::span<const std::string> deletes) override {
    const std::lock_guard lock(mutex_);
    if (Status owner = check_owner(epoch); !owner.ok()) return owner;
    if (fails(faults_->commits)) return told_to("a commit");
    if (applied_sequence < root_.applied)
      return Status(Reason::INVALID_ARGUMENT, "a commit of journal sequence " + std::to_string(applied_sequence) +
                                                  " after one of " + std::to_string(root_.applied));
    Root next = root_;
    next.applied = applied_sequence;
    ++next.commits;
    return write(std::move(next), puts, deletes);
  }

  std::uint64_t applied_sequence() const override {
    const std::lock_guard lock(mutex_);
    return root_.applied;
  }

  std::shared_ptr<const EngineSnapshot> snapshot() const override {
    const std::lock_guard lock(mutex_);
    return std::make_shared<FaultSnapshot>(TableSnapshot(root_.table, root_.commits), faults_);
  }

  Result<SessionNumber> allocate_session(std::uint64_t epoch, SessionNumber skipped) override {
    const std::lock_guard lock(mutex_);
    if (Status owner = check_owner(epoch); !owner.ok()) return owner;
    const auto number = next_session(root_.session, skipped);
    if (!number.ok()) return number;
    Root next = root_;
    next.session = *number;
    if (Status status = write(std::move(next), {}, {}); !status.ok()) return status;
    return root_.session;
  }

  Status checkpoint(const NewFolder&, const EngineProgress&) override {
    return Status(Reason::UNSUPPORTED, "the fault-injecting engine keeps nothing that could be copied to a folder");
  }
  Status compact(const EngineProgress&) override { return {}; }  // a table holds no replaced values

  Result<EngineStats> stats() const override {
    EngineStats stats;
    const auto journal = journal_->bytes();
    if (!journal.ok()) return journal.status();
    stats.journal_bytes = *journal;
    stats.journal_records = journal_->last() + 1 - journal_->first();
    stats.dropped = journal_->dropped();
    const std::lock_guard lock(mutex_);
    stats.map_bytes = TableSnapshot::bytes(*root_.table);
    return stats;
  }

  std::size_t memory_bytes() const override { return 0; }  // it stands in for a disk

 private:
  Status check_owner(std::uint64_t epoch) const {
    if (epoch == root_.epoch) return {};
    return Status(Reason::STALE_OWNER,
                  "epoch " + std::to_string(epoch) + ", the map is owned by " + std::to_string(root_.epoch));
  }

  Status write(Root next, std::span<const Put> puts, std::span<const std::string> deletes) {
    const Bytes record = encode(next, puts, deletes);
    const auto appended = commits_->append({&record, 1});
    if (!appended.ok()) return appended.status();
    if (!puts.empty() || !deletes.empty()) next.table = TableSnapshot::changed(*next.table, puts, deletes);
    root_ = std::move(next);
    return {};
  }

  mutable std::mutex mutex_;
  const std::shared_ptr<Faults> faults_;
  const std::unique_ptr<JournalLog> commits_;
  const std::unique_ptr<JournalLog> journal_;
  Root root_;
};

}  // namespace

Result<std::shared_ptr<Engine>> open_fault_engine(std::shared_ptr<FileSystem> disk, std::shared_ptr<Faults> faults) {
  auto commits = JournalLog::open(disk, "commits", 0, {kSegmentBytes, false});
  if (!commits.ok()) return commits.status();
  if (!(*commits)->loss().ok()) return (*commits)->loss();
  Root root;
  const Status read = (*commits)->read(1, [&](std::uint64_t, ByteSpan record) {
    Change change = decode(record);
    change.root.table = TableSnapshot::changed(*root.table, change.puts, change.deletes);
    root = std::move(change.root);
    return true;
  });
  if (!read.ok()) return read;
  auto journal = JournalLog::open(disk, "journal", root.applied, {kSegmentBytes, false});
  if (!journal.ok()) return journal.status();
  if (!faults) faults = std::make_shared<Faults>();
  return std::shared_ptr<Engine>(
      std::make_shared<FaultEngine>(std::move(faults), std::move(*commits), std::move(*journal), std::move(root)));
}

}  // namespace relmap::storage
