// A data folder in the making. It is written as DIR.partial, and becomes DIR only when it is complete and durable, so
// that nobody takes half of one for a whole.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "storage/engine/engine.h"
#include "storage/io/open_folder.h"
#include "storage/rocksdb/folder.h"

namespace relmap::storage {

class PartialFolder {
 public:
  // The folder must be missing or empty. Neither it nor DIR.partial may be `source` (the data folder that is copied),
  // lie in it or contain it, whatever links lead there; otherwise INVALID_ARGUMENT. DIR.partial is removed if it is
  // what an interrupted attempt left, which its contents show. NOT_ALLOWED if the folder may not be made
  // (NewFolder::roots). FOLDER_LOCKED if another attempt is under way. IO_ERROR.
  static Result<std::unique_ptr<PartialFolder>> begin(const NewFolder& to, const std::string& source);
  // Removes the folder unless it was completed.
  ~PartialFolder();
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  // A path of the folder that holds while this object lives, even if someone moves the folder or puts another, or a
  // link, in its place.
  const std::string& path() const { return path_; }
  // The status with the folder's name in place of path().
  Status named(const Status& status) const;
  // The caller has synced the files in the folder. Syncs their names and gives the folder its final name. IO_ERROR,
  // also if something else stands in its place by now.
  Status complete();

 private:
  PartialFolder(std::unique_ptr<OpenFolder> parent, std::unique_ptr<OpenFolder> own, std::string directory)
      : parent_(std::move(parent)), own_(std::move(own)), directory_(std::move(directory)), path_(own_->path()) {}
  std::string final_name() const;

  const std::unique_ptr<OpenFolder> parent_, own_;
  const std::string directory_;  // DIR
  const std::string path_;
  std::unique_ptr<FolderLock> lock_;
  bool completed_ = false;
};

}  // namespace relmap::storage
