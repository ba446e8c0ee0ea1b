#include "storage/rocksdb/reclaimer.h"

#include <rocksdb/table_properties.h>

#include <utility>

#include "storage/rocksdb/rocksdb_maintenance.h"
#include "storage/rocksdb/rocksdb_status.h"

namespace relmap::storage {
namespace {

constexpr std::uint64_t kCommitsPerLook = 32;
constexpr std::uint64_t kMinBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kShare = 2;  // collected at half of what is kept: freeing a byte moves two
constexpr std::chrono::minutes kLook{1};

std::uint64_t number(rocksdb::DB& db, rocksdb::ColumnFamilyHandle* family, const std::string& name) {
  std::uint64_t value = 0;
  db.GetIntProperty(family, name, &value);
  return value;
}

}  // namespace

Reclaimer::Reclaimer(const MapDatabase& map, JournalLog& journal, bool read_only, Clock now)
    : map_(map), journal_(journal), now_(std::move(now)) {
  if (read_only) return;
  {
    const MutexLock lock(mutex_);
    if (was_deleted()) forget_at_ = now_() + kAfterStart;
  }
  thread_ = std::thread([this] { work(); });
}

Reclaimer::~Reclaimer() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

bool Reclaimer::parts_due() const {
  auto* parts = map_.families().front();
  const std::uint64_t all = number(map_.db(), parts, rocksdb::DB::Properties::kLiveBlobFileSize);
  const std::uint64_t garbage = number(map_.db(), parts, rocksdb::DB::Properties::kLiveBlobFileGarbageSize);
  return garbage >= kMinBytes && kShare * garbage >= all - garbage;
}

// Whether something that is written once has been deleted, and may still be on the disk.
bool Reclaimer::was_deleted() const {
  auto* once = map_.families().back();
  rocksdb::DB& db = map_.db();
  if (number(db, once, rocksdb::DB::Properties::kLiveBlobFileGarbageSize) > 0 ||
      number(db, once, rocksdb::DB::Properties::kNumDeletesActiveMemTable) > 0)
    return true;
  rocksdb::TablePropertiesCollection tables;
  if (!db.GetPropertiesOfAllTables(once, &tables).ok()) return true;
  for (const auto& [name, table] : tables)
    if (table->num_deletions > 0) return true;
  return false;
}

void Reclaimer::look(bool deleted) {
  const MutexLock lock(mutex_);
  if (deleted && !forget_at_) forget_at_ = now_() + kDelay;
  if (++commits_ % kCommitsPerLook == 0 && parts_due()) parts_wanted_ = true;
  if (parts_wanted_ || forget_at_) changed_.notify_all();
}

void Reclaimer::work() {
  const auto going = [this](std::uint64_t, std::uint64_t) {
    const MutexLock lock(mutex_);
    return stopping_ ? Status(Reason::SHUTTING_DOWN, "the map is being closed") : Status();
  };
  MutexLock lock(mutex_);
  while (!stopping_) {
    if (std::exchange(parts_wanted_, false)) {
      const MutexUnlock unlocked(mutex_);
      // A failure is the disk's, which commits report too; a later look tries again.
      (void)compact_families(map_, std::span(map_.families().data(), 1), going);
    } else if (forget_at_ && *forget_at_ <= now_()) {
      forget_at_.reset();  // what is deleted from now on is the next time's
      Status done;
      {
        const MutexUnlock unlocked(mutex_);
        done = compact_families(map_, std::span(&map_.families().back(), 1), going);
        if (done.ok()) done = forget_deleted();
      }
      if (!done.ok()) forget_at_ = now_() + kAgain;
    } else {
      changed_.wait_for(mutex_, kLook);
    }
  }
}

// Ends the logs in which it was written.
Status Reclaimer::forget_deleted() {
  const auto flushed = map_.db().Flush(rocksdb::FlushOptions(), map_.families());
  if (!flushed.ok()) return converted(flushed, "a flush of the map");
  return journal_.leave_applied();
}

}  // namespace relmap::storage
