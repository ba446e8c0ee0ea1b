// RocksDB's errors as ours. Private to the engine.
#pragma once

#include <rocksdb/status.h>

#include "proto/base/status.h"

namespace relmap::storage {

// DATA_LOSS for damage, DISK_FULL, READ_ONLY (the file system is), IO_ERROR otherwise; `what` was done is named, and so
// is the file.
Status converted(const rocksdb::Status& status, const char* what);

}  // namespace relmap::storage
