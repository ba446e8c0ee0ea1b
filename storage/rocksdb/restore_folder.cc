#include "storage/rocksdb/restore_folder.h"

#include <algorithm>
#include <filesystem>
#include <span>
#include <vector>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/io/file.h"
#include "storage/rocksdb/map_files.h"
#include "storage/rocksdb/partial_folder.h"
#include "storage/rocksdb/recorded_hash.h"
#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;

constexpr SessionNumber kSkippedSessions = 1u << 20;

Status copy_files(const std::string& from, const std::string& to, const EngineProgress& progress) {
  const auto disk = posix_file_system();
  for (const char* part : {"/journal", "/map"})
    if (Status made = disk->create_directory(to + part); !made.ok()) return made;
  const std::vector<std::string> files = files_of_map(from);
  std::uint64_t done = 0, total = 0;
  for (const std::string& file : files) total += fs::file_size(from + "/" + file);
  for (const std::string& file : files) {
    const Status copied = copy_map_file(*disk, from + "/" + file, to + "/" + file, /*share=*/false,
                                        [&](std::uint64_t bytes) { return progress(done += bytes, total); });
    if (!copied.ok()) return copied;
  }
  return {};
}

// Takes the engine over, and leaves the map committed with the epoch `now_us`, or with the former epoch + 1 where that
// is later. From then on robots that know the map learn that it lacks what came after the backup. Returns the identity
// that the map has now. A map without an identity is left as it is, and an unknown identity is returned. IO_ERROR,
// DISK_FULL, STALE_OWNER; DATA_LOSS if the map's state cannot be read.
Result<MapIdentity> mark_restored(Engine& engine, std::uint64_t now_us) {
  const auto snapshot = engine.snapshot();
  const auto stored = snapshot->get(keys::map_state());
  if (!stored.ok()) return stored.status();
  if (!stored->has_value()) return MapIdentity{};
  auto state = decode_state(**stored);
  if (!state.ok()) return {Reason::DATA_LOSS, "the map's state: " + state.status().message()};
  if (!state->identity.known()) return MapIdentity{};
  state->identity.epoch = std::max(now_us, state->identity.epoch + 1);
  if (state->digests_commit == snapshot->commit_number()) ++state->digests_commit;  // this commit changes no frame
  const auto owner = engine.acquire();
  if (!owner.ok()) return owner.status();
  const Put put{keys::map_state(), encode_state(*state)};
  const Status done = engine.commit(*owner, engine.applied_sequence(), std::span(&put, 1), {});
  if (!done.ok()) return done;
  // What the map that was backed up has given out since must not be given out again: someone may have noted it.
  if (const auto skipped = engine.allocate_session(*owner, kSkippedSessions); !skipped.ok()) return skipped.status();
  return state->identity;
}

// Moves the recorded hash on: one commit later the map still has it.
Status move_recorded_hash(const std::string& directory, std::uint64_t from, std::uint64_t to) {
  const auto recorded = read_recorded_hash(directory);
  if (!recorded.ok() || !*recorded || (*recorded)->commit != from)
    return {};  // it is of another commit, or damaged, which verify reports
  fs::remove(directory + "/HASH");
  return write_recorded_hash(directory, {to, (*recorded)->hash});
}

// `directory` must be locked.
Result<Restored> mark(const std::string& directory, std::uint64_t now_us) {
  RocksDbOptions options;
  options.locked = true;
  const auto engine = open_rocksdb(directory, options);
  if (!engine.ok()) return Restored{{}, engine.status()};
  const std::uint64_t before = (*engine)->snapshot()->commit_number();
  const auto marked = mark_restored(**engine, now_us);
  if (marked.reason() == Reason::DATA_LOSS) return Restored{{}, marked.status()};
  if (!marked.ok()) return marked.status();
  if (Status moved = move_recorded_hash(directory, before, (*engine)->snapshot()->commit_number()); !moved.ok())
    return moved;
  return Restored{*marked, {}};
}

}  // namespace

Result<Restored> restore_folder(const std::string& backup, const std::string& to, std::uint64_t now_us,
                                const EngineProgress& progress, const CheckCopy& check) try {
  if (!fs::exists(backup + "/FORMAT")) return Status(Reason::NO_SUCH_FILE, backup + " holds no map");
  const auto owned = FolderLock::take_unwritten(backup);
  if (!owned.ok()) return owned.status();
  const auto copy = PartialFolder::begin(to, backup);
  if (!copy.ok()) return copy.status();
  if (Status copied = copy_files(backup, (*copy)->path(), progress); !copied.ok()) return (*copy)->named(copied);
  if (check)
    if (Status sound = check((*copy)->path()); !sound.ok()) return (*copy)->named(sound);
  const auto restored = mark((*copy)->path(), now_us);
  if (!restored.ok()) return (*copy)->named(restored.status());
  if (Status complete = (*copy)->complete(); !complete.ok()) return complete;
  return *restored;
} catch (const fs::filesystem_error& error) {
  return Status(Reason::IO_ERROR, error.what());
}

}  // namespace relmap::storage
