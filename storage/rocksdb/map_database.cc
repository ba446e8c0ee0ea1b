#include "storage/rocksdb/map_database.h"

#include <algorithm>

namespace relmap::storage {
namespace {

const std::string kCold = "cold";

bool is_cold(std::string_view key) { return key[0] == 'c' || key[0] == 'v'; }  // storage/format/keys.h

}  // namespace

std::vector<rocksdb::ColumnFamilyDescriptor> map_families(const rocksdb::Options& options) {
  return {{rocksdb::kDefaultColumnFamilyName, options}, {kCold, options}};
}

rocksdb::Status MapDatabase::open(const rocksdb::Options& options, const std::string& path, bool read_only,
                                  std::unique_ptr<MapDatabase>* database) {
  auto wanted = map_families(options);
  if (read_only) {
    std::vector<std::string> there;
    if (auto listed = rocksdb::DB::ListColumnFamilies(options, path, &there); !listed.ok()) return listed;
    std::erase_if(
        wanted, [&](const auto& family) { return std::find(there.begin(), there.end(), family.name) == there.end(); });
  }
  rocksdb::DB* db = nullptr;
  auto made = std::make_unique<MapDatabase>();
  rocksdb::DBOptions how(options);
  how.create_missing_column_families = true;
  const auto opened = read_only ? rocksdb::DB::OpenForReadOnly(how, path, wanted, &made->families_, &db)
                                : rocksdb::DB::Open(how, path, wanted, &made->families_, &db);
  if (!opened.ok()) return opened;
  made->db_.reset(db);
  *database = std::move(made);
  return {};
}

MapDatabase::~MapDatabase() {
  if (!db_) return;  // its opening was given up half way
  for (auto* family : families_) (void)db_->DestroyColumnFamilyHandle(family);
}

rocksdb::ColumnFamilyHandle* MapDatabase::family(std::string_view key) const {
  return is_cold(key) ? families_.back() : families_.front();
}

}  // namespace relmap::storage
