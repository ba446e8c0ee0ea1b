// The few things a log asks of a file system, so that tests can put one under it that forgets what was not synced.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::storage {

// Errors: IO_ERROR, NO_SUCH_FILE, DISK_FULL (also over a quota), READ_ONLY (the file system is). One thread at a time.
class AppendFile {
 public:
  virtual ~AppendFile() = default;
  virtual Status append(ByteSpan bytes) = 0;
  // Bytes appended and the length are durable on return. After a failure nobody knows which are, and another sync may
  // succeed without writing them: the file is not to be appended to any more.
  virtual Status sync() = 0;
};

// Thread-safe.
class ReadFile {
 public:
  virtual ~ReadFile() = default;
  virtual std::uint64_t size() const = 0;  // when it was opened
  // Exactly `size` bytes from `offset`; IO_ERROR if there are fewer.
  virtual Result<Bytes> read(std::uint64_t offset, std::size_t size) const = 0;
};

struct DiskRoom {
  std::uint64_t free = 0;  // bytes that this process may write
  std::uint64_t size = 0;  // of the file system
};

// Thread-safe. Paths are the caller's, "/" between names. Errors as above.
class FileSystem {
 public:
  virtual ~FileSystem() = default;
  // Fine if it exists. Its name is durable only after sync_directory() of the folder that holds it.
  virtual Status create_directory(const std::string& path) = 0;
  virtual Result<std::vector<std::string>> list(const std::string& directory) const = 0;  // names, ascending
  // At its end; made if it is not there. Its name is durable only after sync_directory().
  virtual Result<std::unique_ptr<AppendFile>> open_append(const std::string& path) = 0;
  virtual Result<std::unique_ptr<ReadFile>> open_read(const std::string& path) const = 0;
  virtual Status truncate(const std::string& path, std::uint64_t size) = 0;  // and sync
  virtual Status remove(const std::string& path) = 0;
  virtual Status sync_directory(const std::string& path) = 0;
  virtual Result<DiskRoom> room(const std::string& directory) const = 0;
  // A file that occupies `bytes` of the disk, for nothing but to be removed. No file is left if that fails.
  virtual Status occupy(const std::string& path, std::uint64_t bytes) = 0;
};

// The machine's own. `sync == false`: every sync returns at once and does nothing; only for a test that must fail.
std::shared_ptr<FileSystem> posix_file_system(bool sync = true);

// Of a file or folder: where its name stands. "." for a name alone.
std::string folder_of(const std::string& path);
// Creates the folder if it is missing, and makes its name durable: also one that a process made which was killed before
// it could. The folder that holds it must exist.
Status create_durable_directory(FileSystem& files, const std::string& path);

}  // namespace relmap::storage
