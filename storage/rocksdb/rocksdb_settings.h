// How RocksDB is set up for chunk parts within one budget. Private to the engine.
#pragma once

#include <rocksdb/options.h>

#include <memory>
#include <string>

#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap {

struct RocksDbSettings {
  rocksdb::Options options;
  std::shared_ptr<rocksdb::Cache> cache;
  std::shared_ptr<rocksdb::Env> env;
};
RocksDbSettings rocksdb_settings(const std::string& directory, const RocksDbOptions& options);

}  // namespace relmap
