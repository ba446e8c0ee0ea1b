#include "storage/rocksdb/rocksdb_engine.h"

#include <rocksdb/cache.h>
#include <rocksdb/db.h>
#include <rocksdb/write_batch.h>

#include <algorithm>
#include <filesystem>

#include "proto/base/mutex.h"
#include "storage/io/disk_space.h"
#include "storage/io/file.h"
#include "storage/journal/journal_log.h"
#include "storage/journal/journal_segment.h"
#include "storage/maintenance/stored_hash.h"
#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/map_database.h"
#include "storage/rocksdb/partial_folder.h"
#include "storage/rocksdb/reclaimer.h"
#include "storage/rocksdb/recorded_hash.h"
#include "storage/rocksdb/resumption.h"
#include "storage/rocksdb/rocksdb_maintenance.h"
#include "storage/rocksdb/rocksdb_settings.h"
#include "storage/rocksdb/rocksdb_status.h"
#include "storage/rocksdb/root.h"

namespace relmap::storage {
namespace {

constexpr char kFirstMapByte = '\1';

// The database and what must outlive it. Snapshots hold it too.
struct Database {
  RocksDbSettings settings;
  std::unique_ptr<FolderLock> lock;  // released after db is closed; null: the caller has it
  std::unique_ptr<DiskSpace> space;  // null: read only
  std::unique_ptr<MapDatabase> map;

  rocksdb::DB& db() const { return map->db(); }
};

class RocksDbSnapshot final : public EngineSnapshot {
 public:
  RocksDbSnapshot(std::shared_ptr<Database> database, std::uint64_t commit)
      : database_(std::move(database)), snapshot_(database_->db().GetSnapshot()), commit_(commit) {}
  ~RocksDbSnapshot() override { database_->db().ReleaseSnapshot(snapshot_); }

  std::uint64_t commit_number() const override { return commit_; }

  Result<std::optional<Bytes>> get(std::string_view key) const override {
    rocksdb::PinnableSlice value;
    const auto status = database_->db().Get(options(), database_->map->family(key), key, &value);
    if (status.IsNotFound()) return std::optional<Bytes>();
    if (!status.ok()) return converted(status, "a read of the map");
    const auto* data = reinterpret_cast<const std::uint8_t*>(value.data());
    return std::optional<Bytes>(Bytes(data, data + value.size()));
  }

  Status scan_from(std::string_view prefix, std::string_view from, const Visit& visit) const override {
    auto read = options();
    read.readahead_size = 256 * 1024;
    read.fill_cache = false;
    std::vector<std::unique_ptr<rocksdb::Iterator>> families;
    const auto read_family = [&](rocksdb::ColumnFamilyHandle* family) {
      families.push_back(std::unique_ptr<rocksdb::Iterator>(database_->db().NewIterator(read, family)));
    };
    if (prefix.empty())
      std::for_each(database_->map->families().begin(), database_->map->families().end(), read_family);
    else
      read_family(database_->map->family(prefix));
    for (const auto& it : families) it->Seek(std::max(from, std::string_view(&kFirstMapByte, 1)));
    for (;;) {
      rocksdb::Iterator* next = nullptr;
      for (const auto& it : families) {
        if (!it->status().ok()) return converted(it->status(), "a scan of the map");
        if (it->Valid() && (!next || it->key().compare(next->key()) < 0)) next = it.get();
      }
      if (!next || !next->key().starts_with(prefix)) return {};
      if (!visit(next->key().ToStringView(), as_bytes(next->value().ToStringView()))) return {};
      next->Next();
    }
  }

 private:
  rocksdb::ReadOptions options() const {
    rocksdb::ReadOptions read;
    read.snapshot = snapshot_;
    return read;
  }

  const std::shared_ptr<Database> database_;
  const rocksdb::Snapshot* const snapshot_;
  const std::uint64_t commit_;
};

Result<Root> read_root(rocksdb::DB& db) {
  std::string bytes;
  const auto found = db.Get(rocksdb::ReadOptions(), kRootKey, &bytes);
  if (found.IsNotFound()) return Root{};
  if (!found.ok()) return converted(found, "a read of the map's root");
  return Root::decode(bytes);
}

// Records the hash of the map in a folder that is being made, as it can be read there. A damaged map is copied all the
// same, without a hash.
Status record_hash(const std::string& directory, const std::function<Status()>& going) {
  RocksDbOptions options;
  options.cache_bytes = std::size_t{8} << 20;
  options.read_only = true;
  auto copy = std::make_shared<Database>();
  copy->settings = rocksdb_settings(directory, options);
  const auto opened = MapDatabase::open(copy->settings.options, directory + "/map", true, &copy->map);
  if (!opened.ok()) return {};
  const auto root = read_root(copy->db());
  if (!root.ok()) return {};
  const RocksDbSnapshot snapshot(copy, root->commits);
  Status stopped;
  const auto hash = hash_stored(snapshot, [&](std::uint64_t, std::uint64_t) { return stopped = going(); });
  if (!stopped.ok()) return stopped;
  return hash.ok() ? write_recorded_hash(directory, {root->commits, *hash}) : Status();
}

class RocksDbEngine final : public Engine {
 public:
  RocksDbEngine(std::string directory, RocksDbOptions options, Status read_only, std::shared_ptr<Database> database,
                std::unique_ptr<JournalLog> journal, Root root)
      : directory_(std::move(directory)),
        options_(std::move(options)),
        read_only_(std::move(read_only)),
        database_(std::move(database)),
        journal_(std::move(journal)),
        root_(root),
        snapshot_(std::make_shared<RocksDbSnapshot>(database_, root_.commits)),
        resumption_(database_->db()),
        reclaimer_(*database_->map, *journal_, !read_only_.ok(), options_.now) {}

  Result<std::uint64_t> acquire() override {
    const MutexLock append_lock(append_mutex_),
        write_lock(write_mutex_);  // no append of the former owner is under way after this
    Root next = writers_root();
    ++next.epoch;
    rocksdb::WriteBatch batch;
    if (Status status = write(next, batch); !status.ok()) return status;
    return next.epoch;
  }

  Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) override {
    const MutexLock lock(append_mutex_);
    {
      const MutexLock root_lock(mutex_);
      if (Status owner = check_owner(epoch, root_); !owner.ok()) return owner;
    }
    if (Status room = database_->space->check(); !room.ok()) return room;
    auto appended = journal_->append(records);
    if (appended.reason() == Reason::DISK_FULL) database_->space->note_failure();
    return appended;
  }

  Status read_journal(std::uint64_t from,
                      const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const override {
    return journal_->read(from, visit);
  }
  std::uint64_t first_journal_sequence() const override { return journal_->first(); }
  std::uint64_t last_journal_sequence() const override { return journal_->last(); }

  Status trim(std::uint64_t through) override { return journal_->trim(through); }

  Status commit(std::uint64_t epoch, std::uint64_t applied_sequence, std::span<const Put> puts,
                std::span<const std::string> deletes) override {
    const MutexLock lock(write_mutex_);
    const Root& root = writers_root();
    if (Status owner = check_owner(epoch, root); !owner.ok()) return owner;
    if (applied_sequence < root.applied)
      return Status(Reason::INVALID_ARGUMENT, "a commit of journal sequence " + std::to_string(applied_sequence) +
                                                  " after one of " + std::to_string(root.applied));
    std::size_t bytes = 64;
    for (const Put& put : puts) bytes += put.key.size() + put.value.size() + 16;
    rocksdb::WriteBatch batch(bytes);
    for (const Put& put : puts)
      batch.Put(database_->map->family(put.key), put.key,
                rocksdb::Slice(reinterpret_cast<const char*>(put.value.data()), put.value.size()));
    bool deleted_for_good = false;  // of what is written once
    for (const std::string& key : deletes) {
      auto* const family = database_->map->family(key);
      deleted_for_good |= family == database_->map->families().back();
      batch.Delete(family, key);
    }
    Root next = root;
    next.applied = applied_sequence;
    ++next.commits;
    if (Status status = write(next, batch); !status.ok()) return status;
    reclaimer_.look(deleted_for_good);
    return {};
  }

  std::uint64_t applied_sequence() const override {
    const MutexLock lock(mutex_);
    return root_.applied;
  }

  std::shared_ptr<const EngineSnapshot> snapshot() const override {
    const MutexLock lock(mutex_);
    return snapshot_;
  }

  Result<SessionNumber> allocate_session(std::uint64_t epoch, SessionNumber skipped) override {
    const MutexLock lock(write_mutex_);
    Root next = writers_root();
    if (Status owner = check_owner(epoch, next); !owner.ok()) return owner;
    if (Status room = database_->space->check(); !room.ok()) return room;
    const auto number = next_session(next.session, skipped);
    if (!number.ok()) return number;
    next.session = *number;
    rocksdb::WriteBatch batch;
    if (Status status = write(next, batch); !status.ok()) return status;
    return next.session;
  }

  Status checkpoint(const NewFolder& to, const EngineProgress& progress) override {
    const auto folder = PartialFolder::begin(to, directory_);
    if (!folder.ok()) return folder.status();
    if (Status copied = copy_to((*folder)->path(), progress); !copied.ok()) return (*folder)->named(copied);
    return (*folder)->complete();
  }

  Status compact(const EngineProgress& progress) override {
    if (!read_only_.ok()) return read_only_;
    return compact_families(*database_->map, database_->map->families(), progress);
  }

  Result<EngineStats> stats() const override {
    EngineStats stats = map_stats(*database_->map);
    const auto bytes = journal_->bytes();
    if (!bytes.ok()) return bytes.status();
    stats.journal_bytes = *bytes;
    stats.journal_records = journal_->last() + 1 - journal_->first();
    stats.dropped = journal_->dropped();
    return stats;
  }

  std::size_t memory_bytes() const override {
    const std::uint64_t pinned = rocksdb_property(database_->db(), rocksdb::DB::Properties::kEstimateTableReadersMem);
    return database_->settings.cache->GetUsage() + pinned;  // the cache does not count what is pinned
  }

 private:
  // The root for holders of write_mutex_, who need not lock mutex_ too: nobody else changes it. Clang cannot be told of
  // a field that two mutexes guard so.
  const Root& writers_root() const RELMAP_REQUIRES(write_mutex_) RELMAP_NO_THREAD_SAFETY_ANALYSIS { return root_; }

  // The journal's files are opened first: what is applied and trimmed before the map is looked at is then in the map.
  Status copy_to(const std::string& folder, const EngineProgress& progress) {
    const auto journal = journal_->keep();
    if (!journal.ok()) return journal.status();
    if (Status format = check_format(folder, false); !format.ok()) return format;
    const auto live = LiveFiles::hold(database_->db());
    if (!live.ok()) return live.status();
    std::uint64_t done = 0, total = (*live)->bytes();
    for (const JournalLog::KeptFile& file : *journal) total += file.bytes;
    const auto copied = [&](std::uint64_t bytes) { return progress(done += bytes, total); };
    if (Status status = (*live)->copy_to(folder + "/map", copied); !status.ok()) return status;
    const auto disk = posix_file_system();
    const std::string journal_folder = folder + "/journal/";
    if (Status made = disk->create_directory(journal_folder); !made.ok()) return made;
    for (const JournalLog::KeptFile& file : *journal) {
      const Status status = copy_file(*file.file, file.bytes, *disk, journal_folder + file.name, copied);
      if (!status.ok()) return status;
    }
    return record_hash(folder, [&] { return progress(total, total); });
  }

  Status check_owner(std::uint64_t epoch, const Root& root) const {
    if (!read_only_.ok()) return read_only_;
    if (epoch == root.epoch) return {};
    return Status(Reason::STALE_OWNER,
                  "epoch " + std::to_string(epoch) + ", the map is owned by " + std::to_string(root.epoch));
  }

  Status write(const Root& next, rocksdb::WriteBatch& batch) RELMAP_REQUIRES(write_mutex_) {
    if (!read_only_.ok()) return read_only_;
    batch.Put(kRootKey, next.encode());
    Status status = write_if_room(batch);
    if (status.reason() == Reason::DISK_FULL && database_->space->give_up_reserve()) status = write_if_room(batch);
    if (!status.ok()) return status;
    std::shared_ptr<const EngineSnapshot> snapshot = std::make_shared<RocksDbSnapshot>(database_, next.commits);
    const MutexLock lock(mutex_);
    root_ = next;
    snapshot_.swap(snapshot);
    return {};
  }

  // RocksDB does not survive a flush that finds no room (Debian's build asserts). So it is given nothing that could not
  // be flushed together with all that waits to be.
  Status write_if_room(rocksdb::WriteBatch& batch) RELMAP_REQUIRES(write_mutex_) {
    constexpr std::uint64_t kBeside = std::uint64_t{1} << 20;  // tables and lists of files
    const std::uint64_t waiting = rocksdb_property(database_->db(), rocksdb::DB::Properties::kCurSizeAllMemTables);
    if (Status room = database_->space->spare(waiting + 2 * batch.GetDataSize() + kBeside); !room.ok()) return room;
    return write(batch);
  }

  // Goes on after a failure as soon as the disk does. The log that failed must not be written to again, since its syncs
  // cannot be trusted; but Resume() leaves that log only if something has to be flushed. Therefore the root is put into
  // memory, beside the log, before anything is written to the log.
  Status write(rocksdb::WriteBatch& batch) RELMAP_REQUIRES(write_mutex_) {
    rocksdb::WriteOptions logged, beside_the_log;
    logged.sync = options_.sync;
    beside_the_log.disableWAL = true;
    rocksdb::Status status = resumption_.go_on();
    if (status.ok())
      status = database_->db().Put(beside_the_log, kRootKey, writers_root().encode());  // takes a new memtable
    if (status.ok()) {
      resumption_.let_flush_start();
      status = database_->db().Write(logged, &batch);
    }
    resumption_.note(status);
    return converted(status, "a commit");
  }

  const std::string directory_;
  const RocksDbOptions options_;
  const Status read_only_;  // not ok: why it was opened for reading
  const std::shared_ptr<Database> database_;
  const std::unique_ptr<JournalLog> journal_;

  // Locked in this order. Neither a slow sync of the journal nor one of the map holds up anything else.
  Mutex append_mutex_;  // guards no data: a new owner waits for the append that is under way
  Mutex write_mutex_;   // held while the map is changed
  mutable Mutex mutex_;
  Root root_ RELMAP_GUARDED_BY(mutex_);  // changed under both, so writers_root() reads it under write_mutex_
  std::shared_ptr<const EngineSnapshot> snapshot_ RELMAP_GUARDED_BY(mutex_);
  Resumption resumption_ RELMAP_GUARDED_BY(write_mutex_);
  Reclaimer reclaimer_ RELMAP_GUARDED_BY(write_mutex_);
};

// RocksDB would begin a new database in place of one that has lost its CURRENT, and delete the files that it does not
// know.
Status check_current(const std::string& directory) {
  const std::string map = directory + "/map";
  std::error_code error;
  if (std::filesystem::exists(map + "/CURRENT", error)) return {};
  if (std::filesystem::exists(directory + "/salvage", error))
    return Status(Reason::DATA_LOSS, map + " is missing: a repair of " + directory + " was interrupted");
  const auto journal = posix_file_system()->list(directory + "/journal");
  const auto first = journal.ok() && !journal->empty() ? SegmentName::parse(journal->front()) : std::nullopt;
  if (first && first->first > 1)
    return Status(Reason::DATA_LOSS, map + " is missing, and the journal holds only what came after it");
  for (const auto& entry : std::filesystem::directory_iterator(map, error)) {
    const auto kind = entry.path().extension();
    if (kind == ".sst" || kind == ".blob" || kind == ".log")
      return Status(Reason::DATA_LOSS, map + "/CURRENT is missing beside " + entry.path().filename().string());
  }
  return {};
}

// Whether the journal goes on from where RocksDB's log and its list of files can be read to. Of what was being written
// to them when the power failed any part may be there, which looks like damage; but nobody was told of a commit in it,
// and the journal has its records. RocksDB removes a log only after the list says durably what took its place.
bool journal_goes_on(const rocksdb::Options& options, const std::string& directory,
                     const std::shared_ptr<FileSystem>& files) {
  std::unique_ptr<MapDatabase> map;
  if (!MapDatabase::open(options, directory + "/map", true, &map).ok()) return false;
  const auto root = read_root(map->db());
  if (!root.ok()) return false;
  const auto journal = JournalLog::open(files, directory + "/journal", root->applied, {.read_only = true});
  return journal.ok() && (*journal)->loss().ok();
}

// Creates the folder of a map, and those above it that are missing, with durable names; otherwise a power failure could
// take away all that was acknowledged.
Status create_folder(const std::string& directory, FileSystem& files) {
  std::error_code error;
  if (!std::filesystem::exists(directory, error)) return create_durable_directories(files, directory);
  // Whoever made the folder may have been killed before its name was durable. An error is ignored: if the folder above
  // is somebody else's and we may not read it, the name is not ours to sync.
  if (!std::filesystem::exists(directory + "/FORMAT", error)) (void)files.sync_directory(folder_of(directory));
  return {};
}

Result<std::shared_ptr<Engine>> open_folder(const std::string& directory, RocksDbOptions options,
                                            const Status& read_only) {
  // Before anything is written: the folder may be somebody's pictures.
  if (Status usable = check_folder(directory); !usable.ok()) return usable;
  const auto disk = posix_file_system(options.sync);
  const auto folders = options.folder_files ? options.folder_files : disk;
  if (!options.read_only)
    if (Status made = create_folder(directory, *folders); !made.ok()) return made;
  std::error_code error;
  auto database = std::make_shared<Database>();
  if (options.read_only && !std::filesystem::is_directory(directory, error))
    return Status(Reason::NO_SUCH_FILE, "there is no folder " + directory);
  if (!options.locked) {
    auto lock = FolderLock::take(directory);
    if (!lock.ok()) return lock.status();
    database->lock = std::move(*lock);
  }
  const int format = options.format ? options.format : kFolderFormat;
  if (Status checked = check_format(directory, options.read_only, format); !checked.ok()) return checked;

  if (Status current = check_current(directory); !current.ok()) return current;

  const auto files = options.journal_files ? options.journal_files : disk;
  if (!options.read_only)
    if (Status made = create_durable_directory(*folders, directory + "/map"); !made.ok()) return made;
  if (!options.read_only) database->space = std::make_unique<DiskSpace>(files, directory, options.space);
  database->settings = rocksdb_settings(directory, options);
  rocksdb::Options& settings = database->settings.options;
  const auto open = [&] {  // RocksDB names the file as a rule, and sometimes not even the folder
    const auto status = MapDatabase::open(settings, directory + "/map", options.read_only, &database->map);
    return converted(status, ("opening of the map in " + directory + "/map").c_str());
  };
  Status opened = open();
  if (opened.reason() == Reason::DISK_FULL && database->space && database->space->give_up_reserve()) opened = open();
  if (opened.reason() == Reason::DATA_LOSS) {
    settings.wal_recovery_mode = rocksdb::WALRecoveryMode::kPointInTimeRecovery;
    *database->settings.forgive_torn_manifest = true;
    if (options.read_only || journal_goes_on(settings, directory, files)) opened = open();
    *database->settings.forgive_torn_manifest = false;
  }
  if (!opened.ok()) return opened;
  const auto root = read_root(database->db());
  if (!root.ok()) return root.status();

  JournalLogOptions log_options;
  log_options.read_only = options.read_only;
  auto journal = JournalLog::open(files, directory + "/journal", root->applied, log_options);
  if (!journal.ok()) return journal.status();
  return std::shared_ptr<Engine>(std::make_shared<RocksDbEngine>(directory, std::move(options), read_only,
                                                                 std::move(database), std::move(*journal), *root));
}

bool may_be_readable(Reason reason) {
  return reason == Reason::DATA_LOSS || reason == Reason::IO_ERROR || reason == Reason::TOO_MANY_FILES ||
         reason == Reason::DISK_FULL || reason == Reason::READ_ONLY;
}

}  // namespace

Status check_data_folder(const std::string& directory) { return check_folder(directory); }

Result<std::shared_ptr<Engine>> open_rocksdb(const std::string& directory, RocksDbOptions options) {
  Status read_only;
  if (options.read_only) read_only = Status(Reason::READ_ONLY, "the map was opened for reading");
  auto opened = open_folder(directory, options, read_only);
  if (opened.ok() || options.read_only || !options.or_read_only || !may_be_readable(opened.reason())) return opened;
  options.read_only = true;
  auto reading = open_folder(directory, options, opened.status());
  return reading.ok() ? reading : opened;
}

}  // namespace relmap::storage
