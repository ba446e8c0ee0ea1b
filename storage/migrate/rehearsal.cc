#include "storage/migrate/rehearsal.h"

#include <chrono>
#include <filesystem>

#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/map_files.h"
#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap::storage {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSpareBytes = std::uint64_t{64} << 20;  // for what RocksDB writes beside the map

bool can_share(const std::string& directory, const std::string& scratch) {
  std::error_code not_linked;
  fs::create_hard_link(directory + "/FORMAT", scratch + "/probe", not_linked);
  fs::remove(scratch + "/probe");
  return !not_linked;
}

// Bytes that a copy and its migration write at most. What is copied from format 1 is written anew, in fewer bytes.
std::uint64_t needed_bytes(const std::string& directory, const std::vector<std::string>& files, int format,
                           bool share) {
  std::uint64_t copied = 0, all = 0;
  for (const std::string& file : files) {
    const std::uint64_t size = fs::file_size(directory + "/" + file);
    all += size;
    if (!share || !is_sharable(file)) copied += size;
  }
  return copied + (format == 1 ? all : copied) + kSpareBytes;
}

void copy_map(const std::string& directory, const std::string& to, const std::vector<std::string>& files, bool share,
              const RehearsalProgress& progress) {
  const auto disk = posix_file_system();
  std::uint64_t done = 0, total = 0;
  for (const std::string& file : files)
    if (!share || !is_sharable(file)) total += fs::file_size(directory + "/" + file);
  for (const char* part : {"", "/journal", "/map"}) throw_if(disk->create_directory(to + part));
  for (const std::string& file : files)
    throw_if(copy_map_file(*disk, directory + "/" + file, to + "/" + file, share,
                           [&](std::uint64_t bytes) { return progress("copying", done += bytes, total); }));
}

MapFactSums facts_of(const std::string& directory, int format, std::uint64_t frames,
                     const RehearsalProgress& progress) {
  RocksDbOptions options;
  options.read_only = true;
  options.format = format;
  const auto engine = open_rocksdb(directory, options).or_throw();
  return sum_facts(*engine, format, [&](std::uint64_t done) { return progress("reading", done, frames); }).or_throw();
}

std::vector<std::string> differences(const MapFactSums& old, const MapFactSums& now) {
  std::vector<std::string> found;
  const auto compare = [&](const char* what, std::uint64_t was, std::uint64_t is) {
    if (was != is) found.push_back(std::string(what) + ": " + std::to_string(was) + ", now " + std::to_string(is));
  };
  compare("sessions", old.sessions, now.sessions);
  compare("frames", old.frames, now.frames);
  compare("edges", old.edges, now.edges);
  compare("landmarks", old.landmarks, now.landmarks);
  compare("observations", old.observations, now.observations);
  compare("features", old.features, now.features);
  compare("labels", old.labels, now.labels);
  compare("journal records", old.journal_records, now.journal_records);
  if (found.empty() && old.hash != now.hash) found.push_back("counts are equal, but some facts have other values");
  return found;
}

// Bytes of a map's files that it shares with none.
std::uint64_t own_bytes(const std::string& map) {
  std::uint64_t sum = 0;
  for (const std::string& file : files_of_map(map))
    if (const std::string path = map + "/" + file; fs::hard_link_count(path) == 1) sum += fs::file_size(path);
  return sum;
}

}  // namespace

Result<MigrationRehearsal> rehearse_migration(const std::string& directory, const std::string& scratch,
                                              const RehearsalProgress& progress) try {
  MigrationRehearsal rehearsal;
  rehearsal.map = scratch + "/map";
  const int format = read_format(directory).or_throw();
  if (format == 0) return Status(Reason::NO_SUCH_FILE, directory + " holds no map");
  rehearsal.migration.from = format;
  rehearsal.migration.to = kFolderFormat;
  if (format == kFolderFormat) return rehearsal;
  if (Status known = check_migratable(directory, format); !known.ok()) return known;

  {
    const auto lock = FolderLock::take_unwritten(directory).or_throw();
    const std::vector<std::string> files = files_of_map(directory);
    const bool share = can_share(directory, scratch);
    const std::uint64_t needed = needed_bytes(directory, files, format, share);
    const DiskRoom room = posix_file_system()->room(scratch).or_throw();
    if (room.free < needed)
      return Status(Reason::DISK_FULL, "the rehearsal may need " + std::to_string(needed) + " bytes in " + scratch +
                                           ", " + std::to_string(room.free) + " are free");
    copy_map(directory, rehearsal.map, files, share, progress);
  }
  rehearsal.facts = facts_of(rehearsal.map, format, 0, progress);
  const auto begun = std::chrono::steady_clock::now();
  rehearsal.migration = migrate_folder(rehearsal.map, [&](std::uint64_t done, std::uint64_t total) {
                          throw_if(progress("migrating", done, total));
                        }).or_throw();
  rehearsal.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  rehearsal.bytes = own_bytes(rehearsal.map);
  rehearsal.differences =
      differences(rehearsal.facts, facts_of(rehearsal.map, kFolderFormat, rehearsal.facts.frames, progress));
  return rehearsal;
} catch (const StatusError& error) {
  return error.status();
} catch (const fs::filesystem_error& error) {
  return Status(Reason::IO_ERROR, error.what());
}

}  // namespace relmap::storage
