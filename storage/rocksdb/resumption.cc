#include "storage/rocksdb/resumption.h"

#include <rocksdb/convenience.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>

#include "storage/rocksdb/rocksdb_maintenance.h"

namespace relmap::storage {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::seconds(30);
constexpr auto kMaxPause = std::chrono::microseconds(20'000);
constexpr auto kStart = std::chrono::milliseconds(100);  // the other threads may all be busy

// Asks again at growing intervals; false if the condition does not hold in time.
template <typename Condition>
bool becomes_true(const Condition& condition, Clock::duration patience) {
  const auto end = Clock::now() + patience;
  for (auto pause = std::chrono::microseconds(20); !condition(); pause = std::min(pause + pause / 2, kMaxPause)) {
    if (Clock::now() >= end) return false;
    std::this_thread::sleep_for(pause);
  }
  return true;
}

}  // namespace

Resumption::~Resumption() {
  if (resuming_.valid()) rocksdb::CancelAllBackgroundWork(&db_, false);
}

rocksdb::Status Resumption::go_on() {
  using Properties = rocksdb::DB::Properties;
  const std::uint64_t errors = rocksdb_property(db_, Properties::kBackgroundErrors);
  if (!failed_ && errors == background_errors_) return {};
  if (!resuming_.valid()) {
    if (!becomes_true([&] { return rocksdb_property(db_, Properties::kNumRunningFlushes) == 0; }, kPatience))
      return rocksdb::Status::TimedOut("a flush that was running when another failed has not ended");
    resuming_ = std::async(std::launch::async, [this] { return db_.Resume(); });
    background_errors_ = errors;  // the next call handles one that comes after this
    failed_ = true;
  }
  if (resuming_.wait_for(kPatience) != std::future_status::ready)
    return rocksdb::Status::TimedOut("RocksDB does not go on after a failure; a restart helps");
  return resuming_.get();
}

void Resumption::let_flush_start() const {
  using Properties = rocksdb::DB::Properties;
  const auto started = [&] {
    return rocksdb_property(db_, Properties::kMemTableFlushPending) == 0 ||
           rocksdb_property(db_, Properties::kNumRunningFlushes) > 0;
  };
  (void)becomes_true(started, kStart);
}

}  // namespace relmap::storage
