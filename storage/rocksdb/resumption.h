// Makes RocksDB go on after a failed write, flush or compaction by DB::Resume(), and avoids the cases in which Resume()
// never returns. A flush that was queued when RocksDB stopped, and that is started while it stands still, is forgotten
// but stays marked as queued, so that a Resume() that waits for it waits for ever (RocksDB 7.8). Hence there is no
// Resume() while a flush is running: it would start those queued behind it and may give up before they are through. And
// there is no write to the log, which may fail, between the queueing of a flush and its start. Private to the engine.
#pragma once

#include <rocksdb/db.h>

#include <cstdint>
#include <future>

namespace relmap::storage {

// For one thread at a time.
class Resumption {
 public:
  explicit Resumption(rocksdb::DB& db) : db_(db) {}
  ~Resumption();
  Resumption(const Resumption&) = delete;
  Resumption& operator=(const Resumption&) = delete;

  // To be called before a write. OK if nothing has failed since the last one, or if RocksDB goes on now. TimedOut if it
  // does not within a minute; another call waits on.
  rocksdb::Status go_on();
  // Returns when the flush that is queued has been started, or after a moment.
  void let_flush_start() const;
  // Reports the outcome of the write.
  void note(const rocksdb::Status& write) { failed_ = !write.ok(); }

 private:
  rocksdb::DB& db_;
  bool failed_ = false;                  // whether the last write failed
  std::uint64_t background_errors_ = 0;  // of flushes and compactions, when last looked at
  std::future<rocksdb::Status> resuming_;
};

}  // namespace relmap::storage
