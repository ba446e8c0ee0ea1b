// RocksDB as the map uses it: what is written once for good, cold parts and words, stands in a column family of its
// own, so that neither compaction nor the collection of garbage among the parts that are rewritten ever reads or moves
// it, and the index of those stays small enough to be in memory. Private to the engine.
#pragma once

#include <rocksdb/db.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace relmap::storage {

class MapDatabase {
 public:
  // Made if it is not there and `read_only` is not set. A map of format 1 has one family for all.
  static rocksdb::Status open(const rocksdb::Options& options, const std::string& path, bool read_only,
                              std::unique_ptr<MapDatabase>* database);
  MapDatabase() = default;  // for open()
  ~MapDatabase();
  MapDatabase(const MapDatabase&) = delete;
  MapDatabase& operator=(const MapDatabase&) = delete;

  rocksdb::DB& db() const { return *db_; }
  const std::vector<rocksdb::ColumnFamilyHandle*>& families() const { return families_; }
  // In which a key stands, or all keys with this prefix (not empty).
  rocksdb::ColumnFamilyHandle* family(std::string_view key) const;

 private:
  std::unique_ptr<rocksdb::DB> db_;
  std::vector<rocksdb::ColumnFamilyHandle*> families_;
};

// The families that a map has.
std::vector<rocksdb::ColumnFamilyDescriptor> map_families(const rocksdb::Options& options);

}  // namespace relmap::storage
