// The files that a map consists of, for those who copy one while nobody owns it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "storage/io/file.h"

namespace relmap::storage {

// The files of a map, relative to its folder: FORMAT, HASH if there is one, journal/ and map/, without what belongs to
// its present owner (LOCK) and what is made anew from the map. Throws std::filesystem::filesystem_error.
std::vector<std::string> files_of_map(const std::string& folder);

// Tables and blobs are never written to again, so that two maps can share them by hard links.
bool is_sharable(const std::string& file);

// Copies a file, or with `share` links it if it is sharable and the file system can. `copied` is called with the size
// of each piece; if it returns a status other than OK, the copy ends with that status. IO_ERROR.
Status copy_map_file(FileSystem& files, const std::string& from, const std::string& to, bool share,
                     const std::function<Status(std::uint64_t bytes)>& copied);

}  // namespace relmap::storage
