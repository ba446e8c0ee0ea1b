#include "storage/rocksdb/rocksdb_maintenance.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <limits>
#include <map>

#include "storage/io/file.h"
#include "storage/rocksdb/rocksdb_status.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;

using Sizes = std::map<std::string, std::uint64_t>;

// Files may come and go meanwhile.
Sizes file_sizes(const std::string& directory) {
  Sizes sizes;
  std::error_code error;
  for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error)) {
    std::error_code gone;
    const std::uint64_t size = it->file_size(gone);
    if (!gone) sizes[it->path().filename().string()] = size;
  }
  return sizes;
}

std::uint64_t live_bytes(rocksdb::DB& db, std::span<rocksdb::ColumnFamilyHandle* const> families) {
  using Properties = rocksdb::DB::Properties;
  std::uint64_t sum = 0;
  for (auto* family : families) {
    std::uint64_t tables = 0, blobs = 0, garbage = 0;
    db.GetIntProperty(family, Properties::kLiveSstFilesSize, &tables);
    db.GetIntProperty(family, Properties::kLiveBlobFileSize, &blobs);
    db.GetIntProperty(family, Properties::kLiveBlobFileGarbageSize, &garbage);
    sum += tables + blobs - garbage;
  }
  return sum;
}

}  // namespace

Result<std::unique_ptr<LiveFiles>> LiveFiles::hold(rocksdb::DB& db) {
  std::unique_ptr<LiveFiles> live(new LiveFiles(db));
  if (auto status = db.DisableFileDeletions(); !status.ok()) return converted(status, "holding the map's files");
  rocksdb::LiveFilesStorageInfoOptions how;
  how.wal_size_for_flush = std::numeric_limits<std::uint64_t>::max();  // logs are copied: the disk may have no room
  const auto status = db.GetLiveFilesStorageInfo(how, &live->files_);
  if (!status.ok()) return converted(status, "a list of the map's files");
  return live;
}

LiveFiles::~LiveFiles() { (void)db_.EnableFileDeletions(/*force=*/false); }

std::uint64_t LiveFiles::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& file : files_) sum += file.size;
  return sum;
}

Status LiveFiles::copy_to(const std::string& directory,
                          const std::function<Status(std::uint64_t bytes)>& copied) const {
  const auto disk = posix_file_system();
  if (Status made = disk->create_directory(directory); !made.ok()) return made;
  for (const auto& file : files_) {
    const std::string from = file.directory + "/" + file.relative_filename;
    const std::string to = directory + "/" + file.relative_filename;
    if (!file.replacement_contents.empty()) {
      auto out = disk->open_append(to);
      if (!out.ok()) return out.status();
      if (Status status = (*out)->append(as_bytes(file.replacement_contents)); !status.ok()) return status;
      if (Status status = (*out)->sync(); !status.ok()) return status;
      continue;
    }
    std::error_code error;
    if (!file.trim_to_size) fs::create_hard_link(from, to, error);
    if (!file.trim_to_size && !error) {
      if (Status status = copied(file.size); !status.ok()) return status;
      continue;
    }
    const auto in = disk->open_read(from);
    if (!in.ok()) return in.status();
    if (Status status = copy_file(**in, file.size, *disk, to, copied); !status.ok()) return status;
  }
  return {};
}

Status compact_families(const MapDatabase& map, std::span<rocksdb::ColumnFamilyHandle* const> families,
                        const EngineProgress& progress) {
  constexpr std::chrono::milliseconds kLook{100};
  constexpr std::uint64_t kLeftFree = std::uint64_t{64} << 20;  // for commits meanwhile
  rocksdb::DB& db = map.db();
  const std::uint64_t total = live_bytes(db, families);
  const auto room_for = [&](std::uint64_t bytes) -> Status {
    std::error_code unknown;
    const auto room = fs::space(db.GetName(), unknown);
    if (unknown || room.available >= bytes + kLeftFree) return {};
    return Status(Reason::DISK_FULL, "compaction writes up to " + std::to_string(total) + " bytes before it deletes, " +
                                         std::to_string(room.available) + " are free");
  };
  if (Status room = room_for(total); !room.ok()) return room;
  std::atomic<bool> cancelled{false};
  rocksdb::CompactRangeOptions how;
  how.bottommost_level_compaction = rocksdb::BottommostLevelCompaction::kForceOptimized;
  how.blob_garbage_collection_policy = rocksdb::BlobGarbageCollectionPolicy::kForce;
  how.blob_garbage_collection_age_cutoff = 1;
  how.canceled = &cancelled;
  const Sizes before = file_sizes(db.GetName());
  auto running = std::async(std::launch::async, [&] {
    rocksdb::Status status;
    for (auto* family : families)
      if (status.ok()) status = db.CompactRange(how, family, nullptr, nullptr);
    return status;
  });
  Status told;
  while (running.wait_for(kLook) != std::future_status::ready) {
    if (!told.ok()) continue;
    std::uint64_t written = 0;
    for (const auto& [name, size] : file_sizes(db.GetName()))
      if (!before.contains(name)) written += size;
    told = progress(std::min(written, total), total);
    if (told.ok()) told = room_for(0);
    cancelled = !told.ok();
  }
  const auto status = running.get();
  return told.ok() ? converted(status, "compaction") : told;
}

EngineStats map_stats(const MapDatabase& map) {
  using Properties = rocksdb::DB::Properties;
  rocksdb::DB& db = map.db();
  EngineStats stats;
  for (const auto& [name, size] : file_sizes(db.GetName())) stats.map_bytes += size;
  stats.blob_bytes = rocksdb_property(db, Properties::kLiveBlobFileSize);
  stats.garbage_bytes = rocksdb_property(db, Properties::kLiveBlobFileGarbageSize);
  for (const auto& name : {Properties::kEstimateNumKeys, Properties::kLiveSstFilesSize, Properties::kNumBlobFiles,
                           Properties::kCurSizeAllMemTables, Properties::kEstimateTableReadersMem,
                           Properties::kEstimatePendingCompactionBytes, Properties::kBackgroundErrors})
    stats.properties.emplace_back(name, std::to_string(rocksdb_property(db, name)));
  for (const auto& name : {Properties::kBlockCacheUsage, Properties::kNumRunningCompactions,
                           Properties::kNumRunningFlushes, Properties::kIsWriteStopped, Properties::kNumSnapshots})
    if (std::string value; db.GetProperty(name, &value)) stats.properties.emplace_back(name, value);
  for (auto* family : map.families())
    for (int level = 0; level < db.NumberLevels(family); ++level) {
      const std::string name = Properties::kNumFilesAtLevelPrefix + std::to_string(level);
      if (std::string value; db.GetProperty(family, name, &value) && value != "0")
        stats.properties.emplace_back(family->GetName() + ": " + name, value);
    }
  return stats;
}

}  // namespace relmap::storage
