// A folder for what is broken, so that nothing is ever deleted for good by a repair.
#pragma once

#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/io/file.h"

namespace relmap::storage {

class Quarantine {
 public:
  explicit Quarantine(std::string directory) : directory_(std::move(directory)), files_(posix_file_system()) {}

  // Durable on return, under `name` or name.2, name.3 ...; IO_ERROR.
  Status keep(const std::string& name, ByteSpan bytes);
  bool used() const { return used_; }
  const std::string& directory() const { return directory_; }

 private:
  const std::string directory_;
  const std::shared_ptr<FileSystem> files_;
  bool used_ = false;
};

}  // namespace relmap::storage
