// File operations of the spool, with errors that name the operation and the path.
#pragma once

#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::publishing::spool_file {

// The mode of new files: they hold what a robot has seen.
inline constexpr unsigned kOwnerOnly = 0600;

// IO_ERROR: "write to PATH: No space left on device".
Status io_error(const std::string& what, const std::string& path);

Status write_all(int file, ByteSpan bytes, const std::string& path);
Result<Bytes> read_all(const std::string& path);
Result<Bytes> read_at(const std::string& path, std::uint64_t offset, std::size_t bytes);
// Makes the creation and renaming of files in a folder durable.
Status sync_folder(const std::string& folder);
// Creates a folder and its missing parents, durably, for this user only.
Status create_folder(const std::string& folder);
// Replaces the content of a file atomically and durably.
Status replace(const std::string& folder, const std::string& name, ByteSpan bytes);

}  // namespace relmap::publishing::spool_file
