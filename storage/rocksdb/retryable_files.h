// RocksDB's files, with failed reads, writes and syncs marked as retryable. RocksDB takes any other failure for fatal
// and writes no more until the database is opened anew; after a marked one, DB::Resume() starts afresh in new files.
// Private to the engine.
#pragma once

#include <rocksdb/file_system.h>

#include <memory>

namespace relmap::storage {

std::shared_ptr<rocksdb::FileSystem> retryable_files(std::shared_ptr<rocksdb::FileSystem> files);

}  // namespace relmap::storage
