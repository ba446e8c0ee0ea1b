// Converts RocksDB's errors to ours. Private to the engine.
#pragma once

#include <rocksdb/status.h>

#include "proto/base/status.h"

namespace relmap::storage {

// DATA_LOSS for damage, DISK_FULL, READ_ONLY (a read-only file system), otherwise IO_ERROR. The message says `what` was
// being done, and names the file.
Status converted(const rocksdb::Status& status, const char* what);

}  // namespace relmap::storage
