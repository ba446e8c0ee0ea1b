#include "storage/rocksdb/partial_folder.h"

#include <filesystem>

#include "storage/io/file.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;

// The path without links, without ".." and without a slash at its end, so that a suffix can be appended.
std::string name_of(const std::string& directory) {
  const fs::path path = fs::weakly_canonical(fs::absolute(directory));
  return (path.has_filename() ? path : path.parent_path()).string();
}

// Whether `path`, which need not exist, is `folder` or lies in it, also by another name, such as one that a mount
// gives.
bool is_within(fs::path path, const fs::path& folder) {
  for (;; path = path.parent_path()) {
    if (path == folder || (fs::exists(path) && fs::equivalent(path, folder))) return true;
    if (path == path.parent_path()) return false;
  }
}

Status check_apart(const std::string& directory, const std::string& source) {
  const fs::path map = fs::canonical(source);
  for (const fs::path& copy : {fs::path(directory), fs::path(directory + ".partial")}) {
    if (is_within(copy, map))
      return Status(Reason::INVALID_ARGUMENT,
                    copy.string() + " lies in " + map.string() + ", the folder that is to be copied");
    if (fs::exists(copy) && is_within(map, copy))
      return Status(Reason::INVALID_ARGUMENT,
                    map.string() + ", the folder that is to be copied, lies in " + copy.string());
  }
  return {};
}

Status clear_leftover(const std::string& path) {
  for (const auto& entry : fs::directory_iterator(path))
    if (entry.path().filename() != "LOCK") fs::remove_all(entry.path());
  return {};
}

}  // namespace

Result<std::unique_ptr<PartialFolder>> PartialFolder::begin(const std::string& given, const std::string& source) {
  try {
    const std::string directory = name_of(given), path = directory + ".partial";
    if (Status apart = check_apart(directory, source); !apart.ok()) return apart;
    if (fs::is_symlink(fs::symlink_status(directory)))
      return Status(Reason::INVALID_ARGUMENT, directory + " is a link that leads nowhere");
    if (fs::exists(directory) && !(fs::is_directory(directory) && fs::is_empty(directory)))
      return Status(Reason::INVALID_ARGUMENT, directory + " exists and is not an empty folder");
    if (fs::exists(path) && !fs::exists(path + "/LOCK") && !(fs::is_directory(path) && fs::is_empty(path)))
      return Status(Reason::INVALID_ARGUMENT, path + " is in the way: it is not what an interrupted attempt left");
    fs::create_directories(path);
    auto lock = FolderLock::take(path);
    if (lock.reason() == Reason::FOLDER_LOCKED)
      return Status(Reason::FOLDER_LOCKED, path + " is being written by another process");
    if (!lock.ok()) return lock.status();
    if (Status cleared = clear_leftover(path); !cleared.ok()) return cleared;
    return std::unique_ptr<PartialFolder>(new PartialFolder(directory, path, std::move(*lock)));
  } catch (const fs::filesystem_error& error) {
    return Status(Reason::IO_ERROR, error.what());
  }
}

PartialFolder::~PartialFolder() {
  if (completed_) return;
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Status PartialFolder::complete() {
  const auto files = posix_file_system();
  try {
    for (const auto& entry : fs::recursive_directory_iterator(path_))
      if (entry.is_directory())
        if (Status synced = files->sync_directory(entry.path().string()); !synced.ok()) return synced;
    if (Status synced = files->sync_directory(path_); !synced.ok()) return synced;
    fs::rename(path_, directory_);  // an empty folder in its place gives way
  } catch (const fs::filesystem_error& error) {
    return Status(Reason::IO_ERROR, error.what());
  }
  completed_ = true;
  return files->sync_directory(fs::path(directory_).parent_path().string());
}

}  // namespace relmap::storage
