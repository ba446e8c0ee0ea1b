#include "storage/rocksdb/salvage.h"

#include <rocksdb/db.h>
#include <rocksdb/sst_file_reader.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>

#include "storage/format/chunk_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/maintenance/stored_sessions.h"
#include "storage/rocksdb/manifest_log.h"
#include "storage/rocksdb/map_database.h"
#include "storage/rocksdb/rocksdb_settings.h"
#include "storage/rocksdb/root.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBatchBytes = std::size_t{8} << 20;
constexpr std::uint32_t kLaterChunks = 64;  // added at most since an older record of a session

Status converted(const rocksdb::Status& status) {
  if (status.ok()) return {};
  return Status(status.IsCorruption() ? Reason::DATA_LOSS : Reason::IO_ERROR, status.ToString());
}

// A store opened for reading, as a snapshot. Where it is damaged, the keys concerned get an error.
class OpenStore final : public EngineSnapshot {
 public:
  explicit OpenStore(std::unique_ptr<MapDatabase> map) : map_(std::move(map)) {}

  std::uint64_t commit_number() const override { return 0; }
  Result<std::optional<Bytes>> get(std::string_view key) const override { return get(key, true); }
  // With `verify` false a blob is returned even where RocksDB's checksum says that it is damaged: our own checksums
  // then say which frames of a chunk are. This does not hold for a table's block: RocksDB would take its damaged bytes
  // for lengths.
  Result<std::optional<Bytes>> get(std::string_view key, bool verify) const {
    rocksdb::ReadOptions read;
    read.verify_checksums = verify;
    read.fill_cache = false;
    rocksdb::PinnableSlice value;
    const auto status = db().Get(read, map_->family(key), key, &value);
    if (status.IsNotFound()) return std::optional<Bytes>();
    if (!status.ok()) return converted(status);
    const auto bytes = as_bytes(value.ToStringView());
    return std::optional<Bytes>(Bytes(bytes.begin(), bytes.end()));
  }
  Status scan_from(std::string_view prefix, std::string_view from, const Visit& visit) const override {
    rocksdb::ReadOptions read;
    auto families = map_->families();
    if (!prefix.empty()) families = {map_->family(prefix)};
    for (auto* family : families) {
      const std::unique_ptr<rocksdb::Iterator> it(db().NewIterator(read, family));
      for (it->Seek(from); it->Valid() && it->key().starts_with(prefix); it->Next())
        if (!visit(it->key().ToStringView(), as_bytes(it->value().ToStringView()))) return {};
      if (!it->status().ok()) return converted(it->status());
    }
    return {};
  }
  rocksdb::DB& db() const { return map_->db(); }

 private:
  const std::unique_ptr<MapDatabase> map_;
};

// Null if it cannot be opened; `why` then says why.
std::unique_ptr<OpenStore> open_store(const rocksdb::Options& options, const std::string& path,
                                      std::string* why = nullptr) {
  std::unique_ptr<MapDatabase> map;
  if (const auto opened = MapDatabase::open(options, path, true, &map); !opened.ok()) {
    if (why) *why = opened.ToString();
    return nullptr;
  }
  return std::make_unique<OpenStore>(std::move(map));
}

std::vector<fs::path> files_of(const std::string& directory, const std::string& extension) {
  std::vector<fs::path> files;
  std::error_code error;
  for (auto it = fs::directory_iterator(directory, error); !error && it != fs::directory_iterator(); ++it)
    if (it->path().extension() == extension) files.push_back(it->path());
  std::sort(files.begin(), files.end());
  return files;
}

// The first or the last bytes of a file, at most `count`.
Bytes end_of(const fs::path& path, std::uint64_t size, std::size_t count, bool last) {
  Bytes bytes(std::min<std::uint64_t>(size, count));
  std::ifstream in(path, std::ios::binary);
  if (last) in.seekg(static_cast<std::streamoff>(size - bytes.size()));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

// RocksDB's own repair makes the list of tables anew, and knows nothing of blob files. Here they are added.
Status list_blob_files(const std::string& directory) {
  std::vector<BlobFile> blobs;
  for (const fs::path& path : files_of(directory, ".blob")) {
    const std::uint64_t size = fs::file_size(path);
    if (const auto blob = blob_file(path.stem().string(), size, end_of(path, size, kBlobHeader, false),
                                    end_of(path, size, kBlobFooter, true)))
      blobs.push_back(*blob);
  }
  std::string manifest;
  std::ifstream(directory + "/CURRENT") >> manifest;
  const std::string path = directory + "/" + manifest;
  std::ifstream in(path, std::ios::binary);
  const std::string old{std::istreambuf_iterator<char>(in), {}};
  const Bytes mended = with_blob_files(as_bytes(old), blobs);
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(mended.data()), static_cast<std::streamsize>(mended.size()));
  return out.flush() ? Status() : Status(Reason::IO_ERROR, path + " cannot be written");
}

class Salvage {
 public:
  Salvage(const std::string& map, const std::string& work, const std::string& copy, const OnFinding& on_finding,
          const OnProgress& on_progress)
      : map_(map), work_(work), copy_(copy), on_finding_(on_finding), on_progress_(on_progress) {
    settings_ = rocksdb_settings(fs::path(map).parent_path(), {});
    options_ = settings_.options;
    options_.create_if_missing = false;
    options_.use_direct_reads = false;  // what is read over and over while a break is narrowed down stays in memory
  }

  Result<SalvageResult> run() {
    SalvageResult result;
    if ((result.sound = reads_whole())) return result;
    if (Status linked = link_files(); !linked.ok()) return linked;
    source_ = open_as_it_is();
    if (!source_) source_ = open_rebuilt();
    if (!source_) return Status(Reason::DATA_LOSS, "nothing of " + map_ + " can be saved: " + why_);
    if (Status copied = copy_all(result); !copied.ok()) return copied;
    source_.reset();
    return result;
  }

 private:
  void tell(const std::string& what) {
    if (on_finding_) on_finding_({Reason::DATA_LOSS, {}, what, true});
  }
  void progress(const char* step, std::uint64_t done) {
    if (on_progress_ && !on_progress_({step, done, 0, "keys"}))
      throw StatusError(Status(Reason::SHUTTING_DOWN, "the repair was stopped; it can be run again"));
  }

  bool reads_whole() {
    const auto store = open_store(options_, map_);
    if (!store) return false;
    std::uint64_t keys = 0;
    bool root = false;
    const Status read = store->scan("", [&](std::string_view key, ByteSpan) {
      root = root || key == kRootKey;
      if (++keys % 64 == 0) progress("reading the store", keys);
      return true;
    });
    // A store without a root is new, and then holds nothing else either.
    return read.ok() && (root || keys == 0) && files_of(map_, ".sst").size() >= live_tables(*store);
  }
  static std::size_t live_tables(const OpenStore& store) {
    std::vector<rocksdb::LiveFileMetaData> files;
    store.db().GetLiveFilesMetaData(&files);
    return files.size();
  }

  // Links tables and blobs, and copies the rest: whatever happens to these, the store stays as it is.
  Status link_files() {
    std::error_code error;
    fs::remove_all(work_, error);
    if (!fs::create_directories(work_, error)) return Status(Reason::IO_ERROR, work_ + ": " + error.message());
    for (const auto& entry : fs::directory_iterator(map_, error)) {
      if (!entry.is_regular_file() || entry.path().filename() == "LOCK") continue;
      const std::string to = work_ + "/" + entry.path().filename().string();
      const auto extension = entry.path().extension();
      if (extension == ".sst" || extension == ".blob") fs::create_hard_link(entry.path(), to, error);
      if (error || (extension != ".sst" && extension != ".blob")) fs::copy_file(entry.path(), to, error);
      if (error) return Status(Reason::IO_ERROR, to + ": " + error.message());
    }
    return error ? Status(Reason::IO_ERROR, map_ + ": " + error.message()) : Status();
  }

  rocksdb::Options forgiving_options() const {
    rocksdb::Options forgiving = options_;
    forgiving.paranoid_checks = false;
    forgiving.wal_recovery_mode = rocksdb::WALRecoveryMode::kSkipAnyCorruptedRecords;
    return forgiving;
  }
  // Opens the store with a list of files that it has, tolerating missing files, if the list is of the tables that are
  // there.
  std::unique_ptr<OpenStore> open_as_it_is() {
    const rocksdb::Options forgiving = forgiving_options();
    std::vector<std::string> manifests;
    std::string current;
    std::ifstream(work_ + "/CURRENT") >> current;
    for (const auto& entry : fs::directory_iterator(work_))
      if (entry.path().filename().string().starts_with("MANIFEST-")) manifests.push_back(entry.path().filename());
    std::sort(manifests.rbegin(), manifests.rend());
    std::stable_partition(manifests.begin(), manifests.end(), [&](const auto& name) { return name == current; });
    for (const std::string& manifest : manifests) {
      std::ofstream(work_ + "/CURRENT") << manifest << "\n";
      auto store = open_store(forgiving, work_);
      if (store && lists_what_is_there(*store)) return store;
    }
    return nullptr;
  }
  // False if some tables are missing from the list and others from the disk: then the list is an older one.
  bool lists_what_is_there(const OpenStore& store) {
    std::vector<rocksdb::LiveFileMetaData> files;
    store.db().GetLiveFilesMetaData(&files);
    std::set<std::string> listed, there;
    for (const auto& file : files) listed.insert(fs::path(file.name).filename());
    for (const fs::path& path : files_of(work_, ".sst")) there.insert(path.filename());
    const bool all_listed = std::includes(listed.begin(), listed.end(), there.begin(), there.end());
    const bool all_there = std::includes(there.begin(), there.end(), listed.begin(), listed.end());
    return all_listed || (all_there && !listed.empty());
  }
  std::unique_ptr<OpenStore> open_rebuilt() {
    tell("the store's list of files cannot be read: made anew from its tables");
    const rocksdb::Options forgiving = forgiving_options();
    if (const auto repaired = rocksdb::RepairDB(work_, forgiving, map_families(forgiving)); !repaired.ok()) {
      why_ = repaired.ToString();
      return nullptr;
    }
    if (Status listed = list_blob_files(work_); !listed.ok()) throw StatusError(listed);
    return open_store(forgiving, work_, &why_);
  }

  Status copy_all(SalvageResult& result) try {
    std::error_code error;
    fs::remove_all(copy_, error);
    rocksdb::Options options = options_;
    options.create_if_missing = true;
    if (auto made = MapDatabase::open(options, copy_, false, &target_); !made.ok()) return converted(made);
    copy_sessions();
    for (const SessionNumber number : numbers_) {
      copy_parts(Part::kHot, number), copy_parts(Part::kWarm, number);
      copy_parts(Part::kCold, number), copy_parts(Part::kWords, number);
    }
    // What the index of labels lost is made anew from the frames.
    (void)copy_keys(keys::labels_beginning(""));
    // Skipped sequences that cannot be copied are recorded as lost later. Frames that wait for relaxation and cannot be
    // copied wait no more.
    for (const SessionNumber number : numbers_)
      if (Status copied = copy_keys(keys::skipped_in(number)); !copied.ok())
        lose("skipped sequences of session " + std::to_string(number) + ": " + copied.to_string());
    (void)copy_keys(keys::all_pending());
    (void)copy_keys(keys::all_edits());
    if (Status copied = copy_keys(keys::all_events()); !copied.ok())
      lose("events, of which those who follow them are told: " + copied.to_string());
    for (int first = 0; first < 256; ++first)
      if (const char byte = static_cast<char>(first); !keys::is_known(byte))
        if (Status copied = copy_keys({&byte, 1}); !copied.ok())
          lose("what a later version wrote: " + copied.to_string());
    copy_state_and_root();
    write();
    const auto closed = target_->db().Flush(rocksdb::FlushOptions(), target_->families());
    target_.reset();
    result.copied = copied_;
    result.lost = lost_;
    if (closed.ok() && copied_ <= 1) return Status(Reason::DATA_LOSS, "nothing of " + map_ + " can be saved");
    return converted(closed);
  } catch (const StatusError& failed) {
    return failed.status();
  }

  void put(std::string_view key, ByteSpan value) {
    batch_.Put(target_->family(key), key, rocksdb::Slice(reinterpret_cast<const char*>(value.data()), value.size()));
    ++copied_;
    if (batch_.GetDataSize() < kBatchBytes) return;
    write();
    progress("saving the store", copied_);
  }
  void write() {
    rocksdb::WriteOptions how;
    how.disableWAL = true;  // flushed and synced at the end
    if (auto written = target_->db().Write(how, &batch_); !written.ok()) throw StatusError(converted(written));
    batch_.Clear();
  }
  void lose(const std::string& what) {
    ++lost_;
    tell(what);
  }

  // Visits the values of a small key in tables of any age: where the newest is damaged, an older one is better than
  // none.
  template <typename Visit>
  void for_each_older(const std::string& key, Visit visit) {
    for (const fs::path& path : files_of(map_, ".sst")) {
      rocksdb::SstFileReader reader(options_);
      if (!reader.Open(path).ok()) continue;
      const std::unique_ptr<rocksdb::Iterator> it(reader.NewIterator(rocksdb::ReadOptions()));
      it->Seek(key);
      if (it->Valid() && it->key() == key) visit(as_bytes(it->value().ToStringView()));
    }
  }

  // The first number behind a damaged block that begins at `bad` or before it; `last` + 1 if the block goes on to the
  // end.
  template <typename Readable>
  static std::uint64_t behind_damage(std::uint64_t bad, std::uint64_t last, Readable readable_from) {
    std::uint64_t step = 1;
    while (bad + step <= last && !readable_from(bad + step)) step *= 2;
    std::uint64_t good = std::min(bad + step, last + 1);
    bad += step / 2;
    while (good - bad > 1) {
      const std::uint64_t middle = bad + (good - bad) / 2;
      (readable_from(middle) ? good : bad) = middle;
    }
    return good;
  }

  // Adds the numbers of all sessions that left a record in any table, in time that grows with the records: the numbers
  // themselves have gaps of a million after each restore.
  void add_older_numbers() {
    for (const fs::path& path : files_of(map_, ".sst")) {
      rocksdb::SstFileReader reader(options_);
      if (!reader.Open(path).ok()) continue;
      const std::unique_ptr<rocksdb::Iterator> it(reader.NewIterator(rocksdb::ReadOptions()));
      const auto readable_from = [&](std::uint64_t number) {
        it->Seek(keys::session(static_cast<SessionNumber>(number)));
        return it->status().ok();
      };
      constexpr std::uint64_t kLast = std::numeric_limits<SessionNumber>::max();
      std::uint64_t next = 1;
      while (next <= kLast) {
        if (!readable_from(next)) {
          next = behind_damage(next, kLast, readable_from);
          continue;
        }
        for (; it->Valid(); it->Next()) {
          const auto number = keys::session_of(it->key().ToStringView());
          if (!number) break;
          numbers_.insert(*number);
          next = std::uint64_t{*number} + 1;
        }
        if (it->status().ok()) break;
      }
    }
  }

  void copy_sessions() {
    const StoredSessions stored = load_sessions(*source_);
    const auto keep = [&](const Session& session) {
      spans_[session.number] = {session.first / kFramesPerChunk, session.last / kFramesPerChunk};
      numbers_.insert(session.number);
      put(keys::session(session.number), encode_session(session));
    };
    for (const Session& session : stored.sessions) keep(session);
    numbers_.insert(stored.unknown.begin(), stored.unknown.end());
    for (const SessionDamage& damage : stored.damage)
      if (damage.number != 0) numbers_.insert(damage.number);
    const std::set<SessionNumber> known = numbers_;
    add_older_numbers();
    for (const SessionNumber number : std::set<SessionNumber>(numbers_)) {
      if (spans_.contains(number)) continue;
      std::optional<Session> best;
      for_each_older(keys::session(number), [&](ByteSpan value) {
        auto session = decode_session(value);
        if (session.ok() && session->number == number && (!best || session->next_sequence > best->next_sequence))
          best = std::move(*session);
      });
      if (!best) {
        if (known.contains(number)) lose("record of session " + std::to_string(number) + " is lost");
        spans_[number] = {};  // its frames are of no use, and stay in the damaged store
        continue;
      }
      tell("record of session " + std::to_string(number) + " is taken from before: through sequence " +
           std::to_string(best->next_sequence));
      keep(*best);
      spans_[number].last += kLaterChunks;
    }
  }

  void copy_parts(Part part, SessionNumber number) {
    for_each_record(*source_, part, number, spans_[number],
                    [&](std::string_view key, ByteSpan value, const Status& status) {
                      if (status.ok()) {
                        copy_part(part, key, value);
                        return true;
                      }
                      const bool in_a_blob = status.message().find("Blob CRC mismatch") != std::string::npos;
                      const auto raw = in_a_blob ? source_->get(key, false) : Result<std::optional<Bytes>>(status);
                      if (!raw.ok() || !*raw || !copy_part(part, key, **raw))
                        lose(std::string(part_name(part)) + " part of " + name_of(key) + ": " + status.to_string());
                      return true;
                    });
  }
  static std::string name_of(std::string_view key) {
    if (const auto frame = keys::frame_of(key)) return "frame " + frame->to_string();
    const auto first = keys::frame_of(std::string(key) + '\0');
    return "chunk " + (first ? chunk_id(*first).to_string() : std::string("?"));
  }
  // Copies a part if it is what the key says: its header must be whole; each frame has a checksum of its own.
  bool copy_part(Part part, std::string_view key, ByteSpan value) {
    const auto frame = keys::frame_of(key.size() == 9 ? std::string(key) + '\0' : std::string(key));
    if (!frame) return false;
    const auto reader = PartReader::open(value, part, chunk_id(*frame));
    if (!reader.ok()) return false;
    newest_commit_ = std::max(newest_commit_, reader->commit());
    put(key, value);
    return true;
  }

  // Copies keys as far as they can be read.
  Status copy_keys(std::string_view prefix) {
    return source_->scan(prefix, [&](std::string_view key, ByteSpan value) {
      put(key, value);
      return true;
    });
  }

  std::optional<Root> find_root() {
    std::optional<Root> root;
    const auto consider = [&](ByteSpan value) {
      const auto found = Root::decode({value.begin(), value.end()});
      if (found.ok() && (!root || found->commits > root->commits)) root = *found;
    };
    if (const auto stored = source_->get(kRootKey); stored.ok() && *stored) consider(**stored);
    if (!root) for_each_older(std::string(kRootKey), consider);
    return root;
  }
  void copy_state_and_root() {
    std::optional<MapState> state = load_sessions(*source_).state;
    if (!state)
      for_each_older(keys::map_state(), [&](ByteSpan value) {
        auto older = decode_state(value);
        if (older.ok() && (!state || older->applied_sequence > state->applied_sequence)) state = std::move(*older);
      });
    if (state) {  // they are not copied: repair makes them anew
      state->digests_commit = 0;
      state->digests_made = {};
    }
    if (state)
      put(keys::map_state(), encode_state(*state));
    else
      lose("the map's state is lost");

    const std::optional<Root> root = find_root();
    if (!root) tell("the map's root is lost, and made anew");
    Root mended = root.value_or(Root{});
    // The commits that the parts know of must have happened.
    mended.commits = std::max(mended.commits, newest_commit_);
    if (state) mended.applied = std::max(mended.applied, state->applied_sequence);
    if (!numbers_.empty()) mended.session = std::max(mended.session, *numbers_.rbegin());
    put(kRootKey, as_bytes(mended.encode()));
  }

  const std::string &map_, &work_, &copy_;
  const OnFinding& on_finding_;
  const OnProgress& on_progress_;
  RocksDbSettings settings_;
  rocksdb::Options options_;
  std::string why_;  // why nothing could be opened
  std::unique_ptr<OpenStore> source_;
  std::unique_ptr<MapDatabase> target_;
  rocksdb::WriteBatch batch_;
  std::set<SessionNumber> numbers_;
  std::map<SessionNumber, ChunkSpan> spans_;
  std::uint64_t copied_ = 0, lost_ = 0, newest_commit_ = 0;
};

}  // namespace

Result<SalvageResult> salvage_store(const std::string& map, const std::string& work, const std::string& copy,
                                    const OnFinding& on_finding, const OnProgress& on_progress) try {
  return Salvage(map, work, copy, on_finding, on_progress).run();
} catch (const StatusError& error) {
  return error.status();
} catch (const std::filesystem::filesystem_error& error) {
  return Status(Reason::IO_ERROR, error.what());
}

Result<StoreHead> read_store_head(const std::string& map) {
  const RocksDbSettings settings = rocksdb_settings(std::filesystem::path(map).parent_path(), {});
  rocksdb::Options options = settings.options;
  options.create_if_missing = false;
  const auto store = open_store(options, map);
  if (!store) return Status(Reason::DATA_LOSS, map + " cannot be opened");
  StoreHead head;
  const auto root = store->get(kRootKey);
  if (!root.ok()) return root.status();
  if (*root) {
    const auto decoded = Root::decode({(**root).begin(), (**root).end()});
    if (!decoded.ok()) return decoded.status();
    head.applied = decoded->applied;
  }
  head.sessions = load_sessions(*store).sessions;
  return head;
}

}  // namespace relmap::storage
