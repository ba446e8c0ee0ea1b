// Watches the free space on the disk of a data folder. When it runs short, nothing new is taken in, while commits,
// which free the journal, still go through. For a commit that would fail all the same there is a reserve: a file that
// is removed then and made again when there is room.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "proto/base/mutex.h"
#include "storage/io/file.h"

namespace relmap::storage {

struct DiskSpaceOptions {
  std::uint64_t low_water = std::uint64_t{256} << 20;  // free bytes; limited to a sixteenth of the disk
  std::uint64_t reserve = std::uint64_t{64} << 20;     // bytes; limited to a quarter of the low-water mark
  std::chrono::milliseconds ask_every{100};            // the file system is asked at most this often
  std::chrono::milliseconds believe_failure{
      1000};  // a failed write overrides the reported free space this long (quotas)
};

// Thread-safe.
class DiskSpace {
 public:
  // Makes the reserve if there is room. The folder must exist.
  DiskSpace(std::shared_ptr<FileSystem> files, std::string folder, DiskSpaceOptions options);

  // DISK_FULL, with the numbers, once fewer bytes are free than the low-water mark. It lasts until a quarter more than
  // the mark is free and the reserve has been made again.
  Status check();
  // DISK_FULL if fewer than `bytes` are free now, whatever the low-water mark says. For callers that must not fail
  // halfway.
  Status spare(std::uint64_t bytes);
  // Reports that a write failed for want of room; check() answers DISK_FULL until there is room again.
  void note_failure();
  // Removes the reserve, for a commit that failed for want of room. Returns true if there was one: then another try is
  // worthwhile.
  bool give_up_reserve();

 private:
  void look(std::chrono::steady_clock::time_point now) RELMAP_REQUIRES(mutex_);

  const std::shared_ptr<FileSystem> files_;
  const std::string folder_;
  const std::string reserve_path_;
  DiskSpaceOptions options_;

  Mutex mutex_;
  std::chrono::steady_clock::time_point look_at_ RELMAP_GUARDED_BY(mutex_){};  // the next look() is not before this
  DiskRoom room_ RELMAP_GUARDED_BY(mutex_);
  bool full_ RELMAP_GUARDED_BY(mutex_) = false;
  bool reserved_ RELMAP_GUARDED_BY(mutex_) = false;
};

}  // namespace relmap::storage
