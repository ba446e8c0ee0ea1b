// A data folder in the making: written as DIR.partial, and DIR only when it is complete and durable, so that nobody
// takes half of one for a whole.
#pragma once

#include <memory>
#include <string>

#include "storage/rocksdb/folder.h"

namespace relmap::storage {

class PartialFolder {
 public:
  // `directory` must not exist or be empty, and neither it nor the one in the making may be `source`, the data folder
  // that is copied, lie in it or hold it, whatever links lead there; else INVALID_ARGUMENT. What an interrupted attempt
  // left is removed; FOLDER_LOCKED if one is under way. IO_ERROR.
  static Result<std::unique_ptr<PartialFolder>> begin(const std::string& directory, const std::string& source);
  // Removes it unless it was completed.
  ~PartialFolder();
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  const std::string& path() const { return path_; }
  // The files in it are synced; this syncs their names and gives the folder its own. IO_ERROR.
  Status complete();

 private:
  PartialFolder(std::string directory, std::string path, std::unique_ptr<FolderLock> lock)
      : directory_(std::move(directory)), path_(std::move(path)), lock_(std::move(lock)) {}

  const std::string directory_, path_;
  const std::unique_ptr<FolderLock> lock_;
  bool completed_ = false;
};

}  // namespace relmap::storage
