// A folder for a rehearsal, which is gone afterwards.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "proto/base/status.h"

namespace relmap::admin {

// The folder in which `folder`, which must exist, stands: what is copied beside it may share its files.
std::string parent_of(const std::string& folder);

class ScratchFolder {
 public:
  // Makes the folder `parent`/relmap-scratch-XXXXXX, and removes those that killed rehearsals of this user left there.
  // NOT_ALLOWED, IO_ERROR.
  static Result<std::unique_ptr<ScratchFolder>> make(const std::string& parent);
  ~ScratchFolder();  // removes it, unless keep() was called
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::string& path() const { return path_; }
  void keep();

 private:
  ScratchFolder(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}

  const std::string path_;
  const int lock_;  // of the file SCRATCH, by which others see that the folder is in use
  bool kept_ = false;
};

}  // namespace relmap::admin
