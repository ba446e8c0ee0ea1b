// How RocksDB is set up for chunk parts within one budget. Private to the engine.
#pragma once

#include <rocksdb/options.h>

#include <atomic>
#include <memory>
#include <string>

#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap::storage {

struct RocksDbSettings {
  std::shared_ptr<rocksdb::Env> env;  // must outlive what the options hold
  std::shared_ptr<rocksdb::Cache> cache;
  rocksdb::Options options;
  std::shared_ptr<std::atomic<bool>> forgive_torn_manifest;  // see torn_manifest.h
};
RocksDbSettings rocksdb_settings(const std::string& directory, const RocksDbOptions& options);

}  // namespace relmap::storage
