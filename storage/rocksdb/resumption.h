// RocksDB after a failed write, flush or compaction: brought to go on by DB::Resume(), without the ways in which that
// never comes back. A flush that was queued when RocksDB stopped and is started while it stands still is forgotten, but
// stays marked as queued, so that the Resume() that waits for it waits for ever (RocksDB 7.8). Hence no Resume() while
// a flush is running, which would start those queued behind it and may give up before they are through; and no write to
// the log, which may fail, between the queueing of a flush and its start. Private to the engine.
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

  // Before a write: OK if nothing has failed since the last, or RocksDB goes on now. TimedOut: not within a
  // minute; another call waits on.
  rocksdb::Status go_on();
  // Returns when the flush that is queued has been started, or after a moment.
  void let_flush_start() const;
  // What became of the write.
  void note(const rocksdb::Status& write) { failed_ = !write.ok(); }

 private:
  rocksdb::DB& db_;
  bool failed_ = false;                  // the last write
  std::uint64_t background_errors_ = 0;  // of flushes and compactions, when last looked at
  std::future<rocksdb::Status> resuming_;
};

}  // namespace relmap::storage
