#include "storage/io/copy_file.h"

#include <algorithm>

namespace relmap::storage {

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
