#include "storage/migrate/migrate.h"

#include <fcntl.h>
#include <linux/fs.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/graph/precision.h"
#include "storage/io/file.h"
#include "storage/maintenance/rebuild.h"
#include "storage/map/map.h"
#include "storage/map/pending_frames.h"
#include "storage/migrate/format1.h"
#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/map_files.h"
#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap::storage {

namespace {

namespace fs = std::filesystem;

constexpr int kOldest = 1;
constexpr std::size_t kBatchBytes = std::size_t{4} << 20;
constexpr std::size_t kCacheBytes = std::size_t{32} << 20;
constexpr std::size_t kRebuildBytes = std::size_t{128} << 20;

[[noreturn]] void lost(const keys::PartKey& key, const std::string& what) {
  throw StatusError(Status(Reason::DATA_LOSS,
                           std::string(part_name(key.part)) + " part of chunk " + key.chunk.to_string() + ": " + what));
}

template <typename Frame>
Frame whole(const keys::PartKey& key, std::optional<Frame> frame) {
  if (!frame) lost(key, "malformed record");
  return std::move(*frame);
}

// Converts a frame's record of format 1 to one of today; empty if today's format stores nothing for it.
Bytes converted(const keys::PartKey& key, FrameId id, ByteSpan body) {
  ByteWriter w;
  switch (key.part) {
    case Part::kHot: {
      FrameHot hot = whole(key, format1::decode_hot(body));
      round_estimates(hot);
      encode_hot(w, id, hot);
      break;
    }
    case Part::kWarm:
      encode_warm(w, id, whole(key, format1::decode_warm(body)));
      break;
    case Part::kCold: {
      const FrameCold cold = whole(key, format1::decode_cold(body));
      if (!cold.appearance.empty() || !cold.picture.empty()) encode_cold(w, cold);
      break;
    }
    case Part::kWords:
      if (const auto words = whole(key, format1::decode_words(body)); !words.empty()) encode_words(w, words);
      break;
  }
  return w.take();
}

// Writes a new map in batches; nobody reads the folder before it is whole.
class Target {
 public:
  Target(const std::string& directory, std::uint64_t applied) : applied_(applied) {
    RocksDbOptions options;
    options.cache_bytes = kCacheBytes;
    engine_ = open_rocksdb(directory, options).or_throw();
    epoch_ = engine_->acquire().or_throw();
  }
  std::uint64_t next_commit() const { return engine_->snapshot()->commit_number() + 1; }
  void put(std::string key, Bytes value) {
    bytes_ += key.size() + value.size();
    puts_.push_back({std::move(key), std::move(value)});
    if (bytes_ >= kBatchBytes) flush();
  }
  void flush() {
    throw_if(engine_->commit(epoch_, applied_, puts_, {}));
    puts_.clear();
    bytes_ = 0;
  }
  // Paths between frames differ from those of format 1, and so does what is derived from paths.
  void rebuild_derived() {
    const auto map = Map::open(engine_, epoch_, std::make_shared<Budget>(kRebuildBytes)).or_throw();
    relmap::storage::rebuild_derived(*map, *engine_, kRebuildBytes, {}, {}).or_throw();
    throw_if(map->rebuild_digests({}));
  }
  // Session numbers are never given twice, not even across a migration.
  void give_out_sessions(SessionNumber through) {
    const SessionNumber first = engine_->allocate_session(epoch_).or_throw();
    if (first < through) (void)engine_->allocate_session(epoch_, through - first - 1).or_throw();
  }

 private:
  std::shared_ptr<Engine> engine_;
  std::uint64_t epoch_ = 0;
  const std::uint64_t applied_;
  std::vector<Put> puts_;
  std::size_t bytes_ = 0;
};

using Progress = std::function<void(std::uint64_t done, std::uint64_t total)>;

void put_state(Target& target, const MapState& state) {
  target.put(keys::map_state(), encode_state(state));
  std::vector<Put> puts;
  std::vector<std::string> deletes;
  write_pending(state.pending, puts, deletes);
  for (Put& put : puts) target.put(std::move(put.key), std::move(put.value));
}

std::uint64_t copy_format1(const Engine& source, Target& target, const Progress& progress) {
  const auto snapshot = source.snapshot();
  std::uint64_t total = 0, done = 0;
  SessionNumber sessions = 0;
  throw_if(snapshot->scan(keys::all_sessions(), [&](std::string_view, ByteSpan value) {
    const format1::SessionRecord record = format1::decode_session(value).or_throw();
    total += record.session.frames;
    sessions = std::max(sessions, record.session.number);
    target.put(keys::session(record.session.number), encode_session(record.session));
    for (const Skipped& item : record.skipped)
      target.put(keys::skipped(record.session.number, item.to), encode_skipped(item));
    return true;
  }));
  throw_if(snapshot->scan("", [&](std::string_view key, ByteSpan value) {
    const auto part = keys::part_of(key);
    if (!part) {
      if (key == keys::map_state())
        put_state(target, format1::decode_state(value).or_throw());
      else if (!key.starts_with(keys::all_sessions()))
        target.put(std::string(key), {value.begin(), value.end()});
      return true;
    }
    const auto reader = PartReader::open(value, part->part, part->chunk, format1::kPartVersion);
    if (!reader.ok()) lost(*part, reader.status().to_string());
    PartWriter writer(part->part, part->chunk, target.next_commit());
    std::size_t frames = 0;
    for (std::size_t i = 0; i < reader->size(); ++i) {
      const auto body = reader->body(i);
      if (!body.ok()) lost(*part, body.status().to_string());
      const Bytes record = converted(*part, frame_in(part->chunk, reader->slot(i)), *body);
      if (record.empty()) continue;
      writer.add(reader->slot(i), record);
      ++frames;
    }
    if (frames > 0) target.put(std::string(key), writer.finish());
    if (part->part == Part::kHot) {
      done += reader->size();
      if (progress) progress(done, total);
    }
    return true;
  }));
  target.flush();
  if (sessions > 0) target.give_out_sessions(sessions);
  target.rebuild_derived();
  return done;
}

// Copies the records that the map does not contain yet.
void copy_journal(const Engine& source, const std::string& directory) {
  RocksDbOptions options;
  options.cache_bytes = kCacheBytes;
  const auto engine = open_rocksdb(directory, options).or_throw();  // now its journal goes on where the map ends
  const std::uint64_t epoch = engine->acquire().or_throw();
  std::vector<Bytes> group;
  std::size_t bytes = 0;
  const auto append = [&] {
    if (!group.empty()) engine->append(epoch, group).or_throw();
    group.clear();
    bytes = 0;
  };
  throw_if(source.read_journal(source.applied_sequence() + 1, [&](std::uint64_t, ByteSpan record) {
    group.emplace_back(record.begin(), record.end());
    bytes += record.size();
    if (bytes >= kBatchBytes) append();
    return true;
  }));
  append();
}

// Parts, sessions, state and journal of format 2 are ones of format 3 without extensions. Tables and blobs, which are
// never written to again, are shared where the disk can; all else is copied.
std::uint64_t copy_format2(const Engine& source, const std::string& from, const std::string& to,
                           const Progress& progress) {
  std::uint64_t frames = 0;
  throw_if(source.snapshot()->scan(keys::all_sessions(), [&](std::string_view, ByteSpan value) {
    frames += decode_session(value).or_throw().frames;
    return true;
  }));
  const auto files = posix_file_system();
  throw_if(files->create_directory(to));
  for (const char* part : {"/journal", "/map"}) {
    throw_if(files->create_directory(to + part));
    for (const auto& entry : fs::directory_iterator(from + part)) {
      const std::string name = entry.path().filename().string(), target = to + part + "/" + name;
      if (!entry.is_regular_file() || name == "LOCK") continue;
      throw_if(
          copy_map_file(*files, entry.path().string(), target, /*share=*/true, [](std::uint64_t) { return Status(); }));
      if (progress) progress(0, frames);
    }
  }
  throw_if(write_format(to, kFolderFormat));
  if (progress) progress(frames, frames);
  return frames;
}

// Former formats have no digests.
void make_digests(const std::string& directory, const Progress& progress) {
  RocksDbOptions options;
  options.cache_bytes = kCacheBytes;
  const auto engine = open_rocksdb(directory, options).or_throw();
  const auto map = Map::open(engine, engine->acquire().or_throw(), std::make_shared<Budget>(kRebuildBytes)).or_throw();
  throw_if(map->rebuild_digests([&](std::uint64_t done, std::uint64_t total) {
    if (progress) progress(done, total);
    return true;
  }));
}

void exchange(const std::string& a, const std::string& b) {
  if (::syscall(SYS_renameat2, AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) != 0)
    throw StatusError(Status(Reason::IO_ERROR, "exchanging " + a + " and " + b + ": " + std::strerror(errno)));
}

Result<MigrateSummary> migrate(const std::string& directory, const Progress& progress) {
  const std::string draft = directory + ".migrating";
  const auto files = posix_file_system();
  const std::string parent = fs::path(directory).parent_path().string();
  const int format = read_format(directory).or_throw();
  if (format == 0) return Status(Reason::NO_SUCH_FILE, directory + " holds no map");
  MigrateSummary summary{format, kFolderFormat, 0, ""};

  const auto keep = [&](int former) {
    summary.kept = directory + ".format-" + std::to_string(former);
    fs::rename(draft, summary.kept);
    return files->sync_directory(parent);
  };
  if (format == kFolderFormat) {
    const auto former = read_format(draft);  // interrupted between changing places and this
    if (!former.ok() || *former == 0 || *former == kFolderFormat) return summary;
    summary.from = *former;
    if (Status kept = keep(*former); !kept.ok()) return kept;
    return summary;
  }
  if (Status known = check_migratable(directory, format); !known.ok()) return known;
  if (fs::exists(directory + ".format-" + std::to_string(format)))
    return Status(Reason::INVALID_ARGUMENT, directory + ".format-" + std::to_string(format) + " is in the way");

  RocksDbOptions options;
  options.read_only = true;
  options.format = format;
  options.cache_bytes = kCacheBytes;
  const auto source = open_rocksdb(directory, options).or_throw();  // locks the folder
  fs::remove_all(draft);                                            // what an interrupted attempt left
  if (format == 1) {
    {
      Target target(draft, source->applied_sequence());
      summary.frames = copy_format1(*source, target, progress);
    }
    copy_journal(*source, draft);
  } else {
    summary.frames = copy_format2(*source, directory, draft, progress);
    make_digests(draft, progress);
  }
  for (const std::string& folder : {draft + "/map", draft + "/journal", draft, parent})
    throw_if(files->sync_directory(folder));
  exchange(directory, draft);
  throw_if(files->sync_directory(parent));
  if (Status kept = keep(format); !kept.ok()) return kept;
  return summary;
}

}  // namespace

Status check_migratable(const std::string& directory, int format) {
  if (format >= kOldest && format <= kFolderFormat) return {};
  return {Reason::UNKNOWN_FORMAT_VERSION, directory + " holds a map of format " + std::to_string(format) +
                                              "; this build migrates format " + std::to_string(kOldest) + " to " +
                                              std::to_string(kFolderFormat)};
}

Result<MigrateSummary> migrate_folder(const std::string& directory, const Progress& progress) {
  try {
    const fs::path path = fs::absolute(directory).lexically_normal();
    return migrate((path.has_filename() ? path : path.parent_path()).string(), progress);
  } catch (const StatusError& error) {
    return error.status();
  } catch (const fs::filesystem_error& error) {
    return Status(Reason::IO_ERROR, error.what());
  }
}

}  // namespace relmap::storage
