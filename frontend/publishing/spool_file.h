// The few calls on files that the spool makes, with errors that say what and where.
#pragma once

#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::publishing::spool_file {

// IO_ERROR: "write to PATH: No space left on device".
Status io_error(const std::string& what, const std::string& path);

Status write_all(int file, ByteSpan bytes, const std::string& path);
Result<Bytes> read_all(const std::string& path);
Result<Bytes> read_at(const std::string& path, std::uint64_t offset, std::size_t bytes);
// So that a file that was made or renamed in it stays so.
Status sync_folder(const std::string& folder);
// With those above it that are missing; their names are durable then.
Status create_folder(const std::string& folder);
// Whole or not at all.
Status replace(const std::string& folder, const std::string& name, ByteSpan bytes);

}  // namespace relmap::publishing::spool_file
