// Room on the disk of a data folder: when it runs short nothing new is taken in, while commits, which free the journal,
// still go through; and for a commit that would fail all the same there is a reserve, a file that is given up then and
// made again when there is room.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "storage/io/file.h"

namespace relmap::storage {

struct DiskSpaceOptions {
  std::uint64_t low_water = std::uint64_t{256} << 20;  // free bytes; at most a sixteenth of the disk
  std::uint64_t reserve = std::uint64_t{64} << 20;     // at most a quarter of the low-water mark
  std::chrono::milliseconds ask_every{100};            // the file system
  std::chrono::milliseconds believe_failure{1000};     // over what the file system says is free (there are quotas)
};

// Thread-safe.
class DiskSpace {
 public:
  // Makes the reserve if there is room; the folder exists.
  DiskSpace(std::shared_ptr<FileSystem> files, std::string folder, DiskSpaceOptions options);

  // DISK_FULL, with the numbers, from when fewer bytes are free than the low-water mark until a quarter more are and
  // the reserve is made again.
  Status check();
  // DISK_FULL if fewer bytes are free now, whatever the mark says: for those who must not fail halfway.
  Status spare(std::uint64_t bytes);
  // A write has failed for want of room: check() says DISK_FULL until there is some.
  void note_failure();
  // For a commit that failed so. True: there was a reserve, and another try is worth it.
  bool give_up_reserve();

 private:
  void look(std::chrono::steady_clock::time_point now);

  const std::shared_ptr<FileSystem> files_;
  const std::string folder_;
  const std::string reserve_path_;
  DiskSpaceOptions options_;

  std::mutex mutex_;
  std::chrono::steady_clock::time_point look_at_{};  // not before
  DiskRoom room_;
  bool full_ = false;
  bool reserved_ = false;
};

}  // namespace relmap::storage
