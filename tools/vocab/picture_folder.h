// Pictures on disk, and their appearance sets.
#pragma once

#include <string>
#include <vector>

#include "proto/keyframe.h"

namespace relmap {

// The files named, and of each folder named every `every`-th JPEG or PNG in the order of names, folders within it
// included. NO_SUCH_FILE.
Result<std::vector<std::string>> list_pictures(const std::vector<std::string>& paths, std::size_t every);

// What the front-end's detector finds. NO_SUCH_FILE, NOT_A_PICTURE, PICTURE_DAMAGED, PICTURE_TOO_LARGE.
Result<std::vector<AppearanceFeature>> appearance_of(const std::string& file);

// Replaces `path` in one step. IO_ERROR.
Status write_file(const std::string& path, const Bytes& bytes);

}  // namespace relmap
