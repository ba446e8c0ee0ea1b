// A data folder: one owner at a time, and a format version. Private to the engine.
#pragma once

#include <memory>
#include <string>

#include "proto/base/status.h"

namespace relmap::storage {

inline constexpr int kFolderFormat = 3;

// Held for as long as the object lives; the system releases it if the process ends. The file LOCK names the owner.
class FolderLock {
 public:
  // FOLDER_LOCKED, with the owner's process id; IO_ERROR.
  static Result<std::unique_ptr<FolderLock>> take(const std::string& directory);
  // The same for a folder that is only read: not even LOCK is written. Without the file LOCK nobody owns the folder,
  // and whoever comes to own it meanwhile is not kept out.
  static Result<std::unique_ptr<FolderLock>> take_unwritten(const std::string& directory);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  explicit FolderLock(int fd) : fd_(fd) {}
  const int fd_;  // -1: there is no file LOCK
};

// The owner of the lock, as far as its file tells: "process 4711".
std::string lock_owner(const std::string& directory);

// Whether the folder is a map's or may become one: it is missing, empty, or holds only what an interrupted first start
// leaves (and lost+found). Writes nothing. NOT_A_MAP: something else lies in it; UNKNOWN_FORMAT_VERSION: it holds the
// parts of a map but no FORMAT, or one that is not ours; IO_ERROR.
Status check_folder(const std::string& directory);

// The format version of the folder; 0 if it has none. UNKNOWN_FORMAT_VERSION if FORMAT is not ours.
Result<int> read_format(const std::string& directory);

// Checks that the folder has this format version, and writes it into a folder that has none (check_folder()).
// UNKNOWN_FORMAT_VERSION, NOT_A_MAP, IO_ERROR; NO_SUCH_FILE if `read_only` and there is none.
Status check_format(const std::string& directory, bool read_only, int format = kFolderFormat);
// Writes the format version, whatever FORMAT says now.
Status write_format(const std::string& directory, int format);

}  // namespace relmap::storage
