// A data folder in the making. It is written as DIR.partial, and becomes DIR only when it is complete and durable, so
// that nobody takes half of one for a whole.
#pragma once

#include <memory>
#include <string>

#include "storage/rocksdb/folder.h"

namespace relmap::storage {

class PartialFolder {
 public:
  // `directory` must be missing or empty. Neither it nor DIR.partial may be `source` (the data folder that is copied),
  // lie in it or contain it, whatever links lead there; otherwise INVALID_ARGUMENT. What an interrupted attempt left is
  // removed. FOLDER_LOCKED if another attempt is under way. IO_ERROR.
  static Result<std::unique_ptr<PartialFolder>> begin(const std::string& directory, const std::string& source);
  // Removes the folder unless it was completed.
  ~PartialFolder();
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  const std::string& path() const { return path_; }
  // The caller has synced the files in the folder. Syncs their names and gives the folder its final name. IO_ERROR.
  Status complete();

 private:
  PartialFolder(std::string directory, std::string path, std::unique_ptr<FolderLock> lock)
      : directory_(std::move(directory)), path_(std::move(path)), lock_(std::move(lock)) {}

  const std::string directory_, path_;
  const std::unique_ptr<FolderLock> lock_;
  bool completed_ = false;
};

}  // namespace relmap::storage
