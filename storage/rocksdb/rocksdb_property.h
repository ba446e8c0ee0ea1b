// A number that RocksDB knows about itself, summed over the column families. Private to the engine.
#pragma once

#include <rocksdb/db.h>

#include <cstdint>
#include <string>

namespace relmap::storage {

// `name`: one of rocksdb::DB::Properties; 0 if RocksDB does not say.
inline std::uint64_t property(rocksdb::DB& db, const std::string& name) {
  std::uint64_t value = 0;
  db.GetAggregatedIntProperty(name, &value);
  return value;
}

}  // namespace relmap::storage
