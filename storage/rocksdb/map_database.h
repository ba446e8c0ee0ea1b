// RocksDB as the map uses it. What is written once for good, cold parts and words, has a column family of its own. So
// neither compaction nor the collection of garbage among the parts that are rewritten ever reads or moves it, and the
// index of those parts stays small enough to be in memory. Private to the engine.
#pragma once

#include <rocksdb/db.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace relmap::storage {

class MapDatabase {
 public:
  // Creates the database if it is missing and `read_only` is not set. A map of format 1 has one family for everything.
  static rocksdb::Status open(const rocksdb::Options& options, const std::string& path, bool read_only,
                              std::unique_ptr<MapDatabase>* database);
  MapDatabase() = default;  // for open()
  ~MapDatabase();
  MapDatabase(const MapDatabase&) = delete;
  MapDatabase& operator=(const MapDatabase&) = delete;

  rocksdb::DB& db() const { return *db_; }
  const std::vector<rocksdb::ColumnFamilyHandle*>& families() const { return families_; }
  // The family of a key, or of all keys with this prefix, which must not be empty.
  rocksdb::ColumnFamilyHandle* family(std::string_view key) const;

 private:
  std::unique_ptr<rocksdb::DB> db_;
  std::vector<rocksdb::ColumnFamilyHandle*> families_;
};

// The families that a map has.
std::vector<rocksdb::ColumnFamilyDescriptor> map_families(const rocksdb::Options& options);

}  // namespace relmap::storage
