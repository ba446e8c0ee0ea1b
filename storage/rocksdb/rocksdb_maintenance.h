// Operations on RocksDB's files as a whole, while it goes on working. Private to the engine.
#pragma once

#include <rocksdb/db.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/rocksdb/map_database.h"

namespace relmap::storage {

// The files that make up the database now. None of them is deleted while the object lives; commits go on.
class LiveFiles {
 public:
  static Result<std::unique_ptr<LiveFiles>> hold(rocksdb::DB& db);
  ~LiveFiles();
  LiveFiles(const LiveFiles&) = delete;
  LiveFiles& operator=(const LiveFiles&) = delete;

  std::uint64_t bytes() const;
  // Links the files that never change, and copies the others and where links are impossible. All is durable but the
  // names.
  Status copy_to(const std::string& directory, const std::function<Status(std::uint64_t bytes)>& copied) const;

 private:
  explicit LiveFiles(rocksdb::DB& db) : db_(db) {}
  rocksdb::DB& db_;
  std::vector<rocksdb::LiveFileStorageInfo> files_;
};

// Rewrites all that is live in these families, blobs included.
Status compact_families(const MapDatabase& map, std::span<rocksdb::ColumnFamilyHandle* const> families,
                        const EngineProgress& progress);

// Without the figures of the journal.
EngineStats map_stats(const MapDatabase& map);

// A number that RocksDB knows about itself, summed over the column families. `name`: one of rocksdb::DB::Properties; 0
// if RocksDB does not say.
inline std::uint64_t rocksdb_property(rocksdb::DB& db, const std::string& name) {
  std::uint64_t value = 0;
  db.GetAggregatedIntProperty(name, &value);
  return value;
}

}  // namespace relmap::storage
