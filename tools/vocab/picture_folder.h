// Files of pictures and of what is made of them.
#pragma once

#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::vocab {

// The files named, and of each folder named every `every`-th JPEG, PNG or WebP in the order of names, folders within it
// included. NO_SUCH_FILE.
Result<std::vector<std::string>> list_pictures(const std::vector<std::string>& paths, std::size_t every);

// Replaces `path` in one step. IO_ERROR.
Status write_file(const std::string& path, const Bytes& bytes);

}  // namespace relmap::vocab
