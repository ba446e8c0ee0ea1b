// RocksDB's files, with the name of a MANIFEST made durable before CURRENT points at it. RocksDB syncs the folder only
// after it has renamed CURRENT into place: on a file system that does not keep the order of names, a power failure left
// a CURRENT whose MANIFEST was gone, and with it the map. Private to the engine.
#pragma once

#include <rocksdb/file_system.h>

#include <memory>

namespace relmap::storage {

std::shared_ptr<rocksdb::FileSystem> durable_manifest(std::shared_ptr<rocksdb::FileSystem> files);

}  // namespace relmap::storage
