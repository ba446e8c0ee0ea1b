// Lists pictures, and writes files.
#pragma once

#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::vocab {

// The files in `paths`, and of each folder in `paths`, subfolders included, every `every`-th JPEG, PNG or WebP in the
// order of names. NO_SUCH_FILE.
Result<std::vector<std::string>> list_pictures(const std::vector<std::string>& paths, std::size_t every);

// Replaces the file `path` atomically. IO_ERROR.
Status write_file(const std::string& path, const Bytes& bytes);

}  // namespace relmap::vocab
