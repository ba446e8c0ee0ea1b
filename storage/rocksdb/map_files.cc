#include "storage/rocksdb/map_files.h"

#include <filesystem>
#include <system_error>

namespace relmap::storage {

namespace fs = std::filesystem;

std::vector<std::string> files_of_map(const std::string& folder) {
  std::vector<std::string> files{"FORMAT"};
  if (fs::exists(folder + "/HASH")) files.push_back("HASH");
  for (const char* part : {"journal", "map"})
    for (const auto& entry : fs::directory_iterator(folder + "/" + part))
      if (entry.is_regular_file() && entry.path().filename() != "LOCK")
        files.push_back(part + ("/" + entry.path().filename().string()));
  return files;
}

bool is_sharable(const std::string& file) { return file.ends_with(".sst") || file.ends_with(".blob"); }

Status copy_map_file(FileSystem& files, const std::string& from, const std::string& to, bool share,
                     const std::function<Status(std::uint64_t bytes)>& copied) {
  if (share && is_sharable(from)) {
    std::error_code not_linked;
    fs::create_hard_link(from, to, not_linked);
    if (!not_linked) return {};
  }
  const auto in = files.open_read(from);
  if (!in.ok()) return in.status();
  return copy_file(**in, (*in)->size(), files, to, copied);
}

}  // namespace relmap::storage
