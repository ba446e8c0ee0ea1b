// An engine on any FileSystem that fails when told to, for tests of durability and recovery; as a rule on one that
// forgets what was not synced (storage/testing/forgetful_files.h). Its journal is the JournalLog of the RocksDB engine;
// commits go to a log of their own.
#pragma once

#include <atomic>
#include <memory>

#include "storage/engine/engine.h"
#include "storage/io/file.h"

namespace relmap::storage {

// How many of the next operations of each kind fail, with IO_ERROR and without effect. Thread-safe.
struct Faults {
  std::atomic<int> appends{0};
  std::atomic<int> commits{0};
  std::atomic<int> reads{0};  // get and scan
};

// Opens what is on the disk. After ForgetfulFiles::restart() engines that were opened before are dead and must be
// opened anew.
Result<std::shared_ptr<Engine>> open_fault_engine(std::shared_ptr<FileSystem> disk,
                                                  std::shared_ptr<Faults> faults = nullptr);

}  // namespace relmap::storage
