#include "storage/io/file.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

namespace relmap::storage {

namespace {

// "map/" is the folder "map".
std::string without_last_slash(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

}  // namespace

std::string folder_of(const std::string& file) {
  const std::string path = without_last_slash(file);
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

Status create_durable_directory(FileSystem& files, const std::string& path) {
  if (Status made = files.create_directory(path); !made.ok()) return made;
  return files.sync_directory(folder_of(path));
}

Status create_durable_directories(FileSystem& files, const std::string& path) {
  std::error_code error;
  std::vector<std::string> missing;
  for (std::string above = without_last_slash(path); !std::filesystem::exists(above, error); above = folder_of(above))
    missing.push_back(above);
  for (auto above = missing.rbegin(); above != missing.rend(); ++above)
    if (Status made = create_durable_directory(files, *above); !made.ok()) return made;
  return {};
}

Status copy_file(const ReadFile& from, std::uint64_t size, FileSystem& files, const std::string& to,
                 const std::function<Status(std::uint64_t bytes)>& copied) {
  constexpr std::uint64_t kPiece = 1 << 20;
  auto file = files.open_append(to);
  if (!file.ok()) return file.status();
  for (std::uint64_t done = 0; done < size;) {
    const auto piece = from.read(done, static_cast<std::size_t>(std::min(kPiece, size - done)));
    if (!piece.ok()) return piece.status();
    if (Status status = (*file)->append(*piece); !status.ok()) return status;
    done += piece->size();
    if (Status status = copied(piece->size()); !status.ok()) return status;
  }
  return (*file)->sync();
}

}  // namespace relmap::storage
