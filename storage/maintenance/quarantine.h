// A folder for what is broken, so that a repair never deletes anything for good.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/io/file.h"

namespace relmap::storage {

class Quarantine {
 public:
  explicit Quarantine(std::string directory, std::shared_ptr<FileSystem> files = posix_file_system())
      : directory_(std::move(directory)), files_(std::move(files)) {}

  // Writes `bytes` to the file `name` or, if that exists, name.2, name.3 ...; the file and the folder are durable on
  // return. IO_ERROR.
  Status keep(const std::string& name, ByteSpan bytes);
  bool used() const { return used_; }
  const std::string& directory() const { return directory_; }

 private:
  const std::string directory_;
  const std::shared_ptr<FileSystem> files_;
  bool used_ = false;
};

}  // namespace relmap::storage
