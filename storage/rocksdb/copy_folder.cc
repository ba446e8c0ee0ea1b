#include "storage/rocksdb/copy_folder.h"

#include <filesystem>
#include <vector>

#include "storage/copy_file.h"
#include "storage/rocksdb/partial_folder.h"

namespace relmap {
namespace {

namespace fs = std::filesystem;

// Relative to the folder; what belongs to its owner of the moment stays behind.
std::vector<std::string> files_of_map(const std::string& folder) {
  std::vector<std::string> files{"FORMAT"};
  if (fs::exists(folder + "/HASH")) files.push_back("HASH");
  for (const char* part : {"journal", "map"})
    for (const auto& entry : fs::directory_iterator(folder + "/" + part))
      if (entry.is_regular_file() && entry.path().filename() != "LOCK")
        files.push_back(part + ("/" + entry.path().filename().string()));
  return files;
}

Status copy_files(const std::string& from, const std::string& to, const EngineProgress& progress) {
  const auto disk = posix_file_system();
  for (const char* part : {"/journal", "/map"})
    if (Status made = disk->create_directory(to + part); !made.ok()) return made;
  const std::vector<std::string> files = files_of_map(from);
  std::uint64_t done = 0, total = 0;
  for (const std::string& file : files) total += fs::file_size(from + "/" + file);
  for (const std::string& file : files) {
    const auto in = disk->open_read(from + "/" + file);
    if (!in.ok()) return in.status();
    const Status copied = copy_file(**in, (*in)->size(), *disk, to + "/" + file,
                                    [&](std::uint64_t bytes) { return progress(done += bytes, total); });
    if (!copied.ok()) return copied;
  }
  return {};
}

}  // namespace

Status copy_folder(const std::string& from, const std::string& to, const EngineProgress& progress) {
  if (!fs::exists(from + "/FORMAT")) return Status(Reason::NO_SUCH_FILE, from + " holds no map");
  const auto owned = FolderLock::take(from);
  if (!owned.ok()) return owned.status();
  const auto copy = PartialFolder::begin(to, from);
  if (!copy.ok()) return copy.status();
  try {
    if (Status copied = copy_files(from, (*copy)->path(), progress); !copied.ok()) return copied;
  } catch (const fs::filesystem_error& error) {
    return Status(Reason::IO_ERROR, error.what());
  }
  return (*copy)->complete();
}

}  // namespace relmap
