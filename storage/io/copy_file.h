// Copies files; the copy is durable on return.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "storage/io/file.h"

namespace relmap::storage {

// Copies the first `size` bytes of `from` to the new file `to` and syncs it; the file's name is durable only after
// sync_directory(). `copied` is called with the size of each piece; if it returns a status other than OK, the copy ends
// with that status. IO_ERROR.
Status copy_file(const ReadFile& from, std::uint64_t size, FileSystem& files, const std::string& to,
                 const std::function<Status(std::uint64_t bytes)>& copied);

}  // namespace relmap::storage
