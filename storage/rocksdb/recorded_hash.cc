#include "storage/rocksdb/recorded_hash.h"

#include <cinttypes>
#include <cstdio>

#include "storage/io/file.h"
#include "storage/maintenance/stored_hash.h"

namespace relmap::storage {
namespace {

std::string path_of(const std::string& directory) { return directory + "/HASH"; }

std::string line_of(const RecordedHash& recorded) {
  char line[128];
  std::snprintf(line, sizeof line,
                "relmap hash %d commit %" PRIu64 " structure %016" PRIx64 " estimates %016" PRIx64 "\n",
                kMapHashVersion, recorded.commit, recorded.hash.structure, recorded.hash.estimates);
  return line;
}

}  // namespace

Status write_recorded_hash(const std::string& directory, const RecordedHash& recorded) {
  auto file = posix_file_system()->open_append(path_of(directory));
  if (!file.ok()) return file.status();
  if (Status status = (*file)->append(as_bytes(line_of(recorded))); !status.ok()) return status;
  return (*file)->sync();
}

Result<std::optional<RecordedHash>> read_recorded_hash(const std::string& directory) {
  const auto file = posix_file_system()->open_read(path_of(directory));
  if (file.reason() == Reason::NO_SUCH_FILE) return std::optional<RecordedHash>();
  if (!file.ok()) return file.status();
  const auto bytes = (*file)->read(0, std::min<std::uint64_t>((*file)->size(), 256));
  if (!bytes.ok()) return bytes.status();
  const std::string line(bytes->begin(), bytes->end());
  int version = 0;
  RecordedHash recorded;
  const int fields =
      std::sscanf(line.c_str(), "relmap hash %d commit %" SCNu64 " structure %" SCNx64 " estimates %" SCNx64, &version,
                  &recorded.commit, &recorded.hash.structure, &recorded.hash.estimates);
  if (fields >= 1 && version > kMapHashVersion) return std::optional<RecordedHash>();
  if (fields != 4 || line != line_of(recorded)) return Status(Reason::CORRUPT, path_of(directory) + " is damaged");
  return std::optional<RecordedHash>(recorded);
}

Result<bool> agrees_with_recorded_hash(const std::string& directory, const EngineSnapshot& snapshot,
                                       const EngineProgress& progress) {
  const auto recorded = read_recorded_hash(directory);
  if (recorded.reason() == Reason::CORRUPT) return Status(Reason::DATA_LOSS, recorded.status().message());
  if (!recorded.ok()) return recorded.status();
  if (!*recorded || (*recorded)->commit != snapshot.commit_number()) return false;
  const auto hash = hash_stored(snapshot, progress);
  if (!hash.ok()) return hash.status();
  if (*hash == (*recorded)->hash) return true;
  return Status(Reason::DATA_LOSS, "the map is not the one of which " + path_of(directory) + " tells");
}

}  // namespace relmap::storage
