// RocksDB's files, with a log of its own (LOG) that may lose lines. RocksDB, as Debian builds it, ends the process at
// the next line after one that could not be written; a full disk would be enough. Private to the engine.
#pragma once

#include <rocksdb/file_system.h>

#include <memory>

namespace relmap::storage {

std::shared_ptr<rocksdb::FileSystem> lossy_info_log(std::shared_ptr<rocksdb::FileSystem> files);

}  // namespace relmap::storage
