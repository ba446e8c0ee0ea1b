// The few operations that a log needs of a file system, as an interface: tests can put one under the log that forgets
// what was not synced.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::storage {

// Errors: IO_ERROR, NO_SUCH_FILE, DISK_FULL (also over a quota), READ_ONLY (a read-only file system). For one thread at
// a time.
class AppendFile {
 public:
  virtual ~AppendFile() = default;
  virtual Status append(ByteSpan bytes) = 0;
  // Makes the appended bytes and the file's length durable. After a failure nobody knows which bytes are durable, and
  // another sync may succeed without writing them, so the file must not be appended to any more.
  virtual Status sync() = 0;
};

// Thread-safe.
class ReadFile {
 public:
  virtual ~ReadFile() = default;
  virtual std::uint64_t size() const = 0;  // of the file when it was opened
  // Reads exactly `size` bytes from `offset`; IO_ERROR if there are fewer.
  virtual Result<Bytes> read(std::uint64_t offset, std::size_t size) const = 0;
};

struct DiskRoom {
  std::uint64_t free = 0;  // bytes that this process may write
  std::uint64_t size = 0;  // of the file system
};

// Thread-safe. Names in a path are separated by "/". Errors are those of AppendFile.
class FileSystem {
 public:
  virtual ~FileSystem() = default;
  // Succeeds if the directory exists already. Its name is durable only after sync_directory() of its parent.
  virtual Status create_directory(const std::string& path) = 0;
  virtual Result<std::vector<std::string>> list(const std::string& directory) const = 0;  // names, ascending
  // Opens the file to append to its end; creates it if it is missing. A new name is durable only after
  // sync_directory().
  virtual Result<std::unique_ptr<AppendFile>> open_append(const std::string& path) = 0;
  virtual Result<std::unique_ptr<ReadFile>> open_read(const std::string& path) const = 0;
  virtual Status truncate(const std::string& path, std::uint64_t size) = 0;  // durable on return
  virtual Status remove(const std::string& path) = 0;
  virtual Status sync_directory(const std::string& path) = 0;
  virtual Result<DiskRoom> room(const std::string& directory) const = 0;
  // Creates a file that occupies `bytes` of the disk, as a reserve to be removed later. If that fails, no file is left.
  virtual Status occupy(const std::string& path, std::uint64_t bytes) = 0;
};

// The machine's file system. With `sync == false` every sync returns at once and does nothing: only for a test that
// must then fail.
std::shared_ptr<FileSystem> posix_file_system(bool sync = true);

// The folder that contains the file or folder `path`; "." for a name without a folder.
std::string folder_of(const std::string& path);
// Creates the folder if it is missing, and syncs its parent in any case: a process that was killed may have created the
// folder without syncing its name. The parent folder must exist.
Status create_durable_directory(FileSystem& files, const std::string& path);
// The same for all folders of `path` that are missing, the outermost first.
Status create_durable_directories(FileSystem& files, const std::string& path);

// Copies the first `size` bytes of `from` to the new file `to` and syncs it; the file's name is durable only after
// sync_directory(). `copied` is called with the size of each piece; if it returns a status other than OK, the copy ends
// with that status. IO_ERROR.
Status copy_file(const ReadFile& from, std::uint64_t size, FileSystem& files, const std::string& to,
                 const std::function<Status(std::uint64_t bytes)>& copied);

}  // namespace relmap::storage
