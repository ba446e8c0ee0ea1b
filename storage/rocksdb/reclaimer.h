// Frees the space of replaced hot and warm parts when there is enough of it. RocksDB's own collection goes by age:
// every compaction moves the values in the oldest quarter of the files, garbage or not. Private to the engine.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "storage/rocksdb/map_database.h"

namespace relmap::storage {

// One thread calls look(); the work is done in a thread of its own.
class Reclaimer {
 public:
  explicit Reclaimer(const MapDatabase& map) : map_(map) {}
  ~Reclaimer();  // stops what is under way
  Reclaimer(const Reclaimer&) = delete;
  Reclaimer& operator=(const Reclaimer&) = delete;

  // To be called after each commit.
  void look();

 private:
  bool due() const;

  const MapDatabase& map_;
  std::uint64_t commits_ = 0;
  std::atomic<bool> stopping_{false}, working_{false};
  std::thread thread_;
};

}  // namespace relmap::storage
