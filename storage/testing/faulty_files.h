// A disk that fails on demand: full, read-only, or with errors on writing, syncing or reading. Only for tests.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "storage/io/file.h"

namespace relmap::storage {

// What fails now, and with which reason; OK: nothing fails. Thread-safe.
struct DiskFaults {
  std::atomic<Reason> write{
      Reason::OK};  // DISK_FULL: half of the bytes are written; READ_ONLY: names do not change either
  std::atomic<bool> removal_helps{false};  // DISK_FULL ends when a file is removed
  std::atomic<Reason> sync{Reason::OK};
  std::atomic<Reason> read{Reason::OK};
  std::atomic<bool> hang{false};  // writes of the map's files wait while this is set
  std::atomic<std::uint64_t> free{std::uint64_t{1} << 40}, size{std::uint64_t{1} << 40};  // what room() says
};

// Faults strike files and folders whose paths contain `only`.
std::shared_ptr<FileSystem> faulty_files(std::shared_ptr<FileSystem> files, std::shared_ptr<DiskFaults> faults,
                                         const std::string& only = "");

}  // namespace relmap::storage
