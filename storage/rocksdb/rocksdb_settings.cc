#include "storage/rocksdb/rocksdb_settings.h"

#include <fcntl.h>
#include <rocksdb/cache.h>
#include <rocksdb/env.h>
#include <rocksdb/file_system.h>
#include <rocksdb/filter_policy.h>
#include <rocksdb/table.h>
#include <rocksdb/write_buffer_manager.h>
#include <unistd.h>

#include <algorithm>

#include "storage/rocksdb/durable_manifest.h"
#include "storage/rocksdb/gradual_deletion.h"
#include "storage/rocksdb/lossy_info_log.h"
#include "storage/rocksdb/retryable_files.h"
#include "storage/rocksdb/torn_manifest.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

// Some file systems have no direct I/O: opening a file for it fails there.
bool has_direct_io(const std::string& directory) {
  const int fd = ::open((directory + "/FORMAT").c_str(), O_RDONLY | O_DIRECT | O_CLOEXEC);
  if (fd >= 0) ::close(fd);
  return fd >= 0;
}

}  // namespace

RocksDbSettings rocksdb_settings(const std::string& directory, const RocksDbOptions& wanted) {
  RocksDbSettings settings;
  settings.cache = rocksdb::NewLRUCache(std::max(wanted.cache_bytes, kMiB), /*num_shard_bits=*/2);
  rocksdb::Options& o = settings.options;
  o.create_if_missing = true;
  o.paranoid_checks = !wanted.read_only;  // a reader serves the files that there are

  // Small memtables, their memory charged to the cache. The log of a commit is short-lived: flushed parts are in files.
  o.write_buffer_size = std::clamp(wanted.cache_bytes / 8, kMiB, 16 * kMiB);
  o.max_write_buffer_number = 3;
  o.write_buffer_manager = std::make_shared<rocksdb::WriteBufferManager>(3 * o.write_buffer_size, settings.cache);
  o.max_total_wal_size = 8 * o.write_buffer_size;  // the family that changes least pins it
  o.keep_log_file_num = 2;
  o.max_log_file_size = kMiB;
  o.info_log_level = rocksdb::WARN_LEVEL;
  o.max_open_files = 256;
  o.max_background_jobs = 2;
  // The default would drop acknowledged commits behind a flipped bit in silence; this fails the start instead. A torn
  // last record is no damage.
  o.wal_recovery_mode = rocksdb::WALRecoveryMode::kTolerateCorruptedTailRecords;

  // Parts are large and live long: blob files keep compaction from moving them. Garbage is the Reclaimer's affair.
  o.enable_blob_files = true;
  o.min_blob_size = 4096;
  o.blob_file_size = 64 * kMiB;
  o.compression = rocksdb::kNoCompression;  // doubles and descriptors do not shrink
  o.target_file_size_base = 16 * kMiB;
  o.max_bytes_for_level_base = 64 * kMiB;
  o.compaction_readahead_size = kMiB;
  o.bytes_per_sync = kMiB;

  rocksdb::BlockBasedTableOptions table;
  table.block_cache = settings.cache;
  table.cache_index_and_filter_blocks = true;
  table.pin_l0_filter_and_index_blocks_in_cache = false;
  table.filter_policy.reset(rocksdb::NewBloomFilterPolicy(10));
  table.block_size = 8 * 1024;
  table.cache_usage_options.options_overrides[rocksdb::CacheEntryRole::kBlockBasedTableReader].charged =
      rocksdb::CacheEntryRoleOptions::Decision::kEnabled;
  o.table_factory.reset(rocksdb::NewBlockBasedTableFactory(table));

  const bool direct = wanted.direct_io && !wanted.map_files && has_direct_io(directory);
  o.use_direct_reads = direct;
  o.use_direct_io_for_flush_and_compaction = direct;
  auto files = wanted.map_files ? wanted.map_files : gradual_deletion(rocksdb::FileSystem::Default());
  settings.forgive_torn_manifest = std::make_shared<std::atomic<bool>>(false);
  // What these do for RocksDB is noexcept where it takes memory: RocksDB does not survive that an exception passes it,
  // so the process ends at once, and says why (server/monitor/last_words.h).
  settings.env = rocksdb::NewCompositeEnv(lossy_info_log(
      retryable_files(torn_manifest(durable_manifest(std::move(files)), settings.forgive_torn_manifest))));
  o.env = settings.env.get();
  o.max_bgerror_resume_count = 0;        // the engine's commits resume
  o.avoid_flush_during_shutdown = true;  // what was put beside the log is in the log too
  return settings;
}

}  // namespace relmap::storage
