// Copies of whole files, durable on return.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "storage/io/file.h"

namespace relmap::storage {

// The first `size` bytes of `from` into a new file at `to`; its name is durable only after sync_directory(). `copied`
// is told of each piece; what it answers, if not ok, ends the copy with just that. IO_ERROR.
Status copy_file(const ReadFile& from, std::uint64_t size, FileSystem& files, const std::string& to,
                 const std::function<Status(std::uint64_t bytes)>& copied);

}  // namespace relmap::storage
