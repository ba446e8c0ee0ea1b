// RocksDB's errors as ours. Private to the engine.
#pragma once

#include <rocksdb/status.h>

#include "proto/status.h"

namespace relmap {

// DATA_LOSS for damage, IO_ERROR otherwise; `what` was done is named.
Status converted(const rocksdb::Status& status, const char* what);

}  // namespace relmap
