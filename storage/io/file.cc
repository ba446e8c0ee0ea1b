#include "storage/io/file.h"

namespace relmap::storage {

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

Status create_durable_directory(FileSystem& files, const std::string& path) {
  if (Status made = files.create_directory(path); !made.ok()) return made;
  return files.sync_directory(folder_of(path));
}

}  // namespace relmap::storage
