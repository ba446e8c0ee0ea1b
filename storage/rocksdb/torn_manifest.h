// RocksDB's files, with a MANIFEST that can be read to its last whole record. A power failure may leave the record that
// was being written with zeros in place of some sectors, and RocksDB takes that for damage of the whole. Private to the
// engine.
#pragma once

#include <rocksdb/file_system.h>

#include <atomic>
#include <memory>

namespace relmap::storage {

// While `forgive` is set, a MANIFEST whose end is torn is read without it (manifest_log.h). Whoever sets it must look
// whether what is read then is all that counts.
std::shared_ptr<rocksdb::FileSystem> torn_manifest(std::shared_ptr<rocksdb::FileSystem> files,
                                                   std::shared_ptr<const std::atomic<bool>> forgive);

}  // namespace relmap::storage
