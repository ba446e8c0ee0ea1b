// Deletes RocksDB's files by small steps. Where the file system discards what is freed (mount option `discard`), a
// deletion holds up every read and sync on the disk until all of it is done: 2 ms and 1.6 ms per MiB on a virtual disk,
// 16 ms for a log, 80 ms for a blob file. When a file is cut off MiB by MiB, other operations get in between. Private
// to the engine.
#pragma once

#include <rocksdb/file_system.h>

#include <memory>

namespace relmap::storage {

std::shared_ptr<rocksdb::FileSystem> gradual_deletion(std::shared_ptr<rocksdb::FileSystem> files);

}  // namespace relmap::storage
