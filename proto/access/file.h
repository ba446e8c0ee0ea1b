// Reads and writes the files of this folder.
#pragma once

#include <string>
#include <string_view>

#include "proto/base/status.h"

namespace relmap::access {

// NO_SUCH_FILE if it cannot be opened, IO_ERROR if it cannot be read to its end or is no file.
Result<std::string> read_file(const std::string& path);

// The same for a file that must be readable by its owner only: else BAD_CONFIG, with what to do.
Result<std::string> read_private_file(const std::string& path);

// Writes the file with mode 0600 whatever the umask, under a temporary name that is then renamed, so that readers see
// the old text or the new. It belongs to the owner of the file that it replaces, or else of its folder, so that a
// daemon of another user can still read what root has changed. IO_ERROR.
Status write_private_file(const std::string& path, std::string_view text);

// Holds a lock on a folder until it is destroyed, so that two programs do not change the files in it at a time.
class FolderTurn {
 public:
  // Waits for the lock. IO_ERROR.
  static Result<FolderTurn> take(const std::string& folder);
  FolderTurn(FolderTurn&& other) noexcept;
  ~FolderTurn();

 private:
  explicit FolderTurn(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

}  // namespace relmap::access
