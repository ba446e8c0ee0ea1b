// Any changes to the files of a small map's store, and any of them missing: what can be saved is, in a store that can
// be read, or there is a reason why not; the damaged store stays as it is. Each change is a byte that chooses the file,
// and a patch; with the highest bit the file is removed instead.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "storage/maintenance/testing/driven_map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/rocksdb/salvage.h"
#include "storage/testing/patches.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
namespace fs = std::filesystem;

constexpr std::size_t kChanges = 8;
constexpr std::uint32_t kFewFrames = 70;  // more than a chunk, so that there are blobs

void must(bool holds) {
  if (!holds) std::abort();
}

using Files = std::map<std::string, Bytes>;

Files files_in(const std::string& folder) {
  Files files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (!entry.is_regular_file() || name == "LOCK" || name.starts_with("LOG")) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    files[name] = {text.begin(), text.end()};
  }
  return files;
}

void write(const std::string& folder, const Files& files) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const auto& [name, bytes] : files) {
    std::ofstream out(folder + "/" + name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    must(out.flush().good());
  }
}

// The store of a drive of which a part is compacted and the rest in later tables and in RocksDB's own log.
Files make_store(const std::string& data) {
  {
    RocksDbOptions options;
    options.cache_bytes = std::size_t{8} << 20;
    const auto engine = open_rocksdb(data, options).or_throw();
    drive_map(engine, kFewFrames);
    must(engine->compact([](std::uint64_t, std::uint64_t) { return Status(); }).ok());
    const auto map = open_map(engine);
    map->set_label({1, 3}, "hall", true);
    must(map->commit().ok());
  }
  return files_in(data + "/map");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TemporaryFolder kFolder;
  static const Files kSound = make_store(kFolder / "sound");
  Files files = kSound;
  ByteReader in({data, size});
  for (std::size_t i = 0; i < kChanges && in.remaining() > 0 && !files.empty(); ++i) {
    const auto which = in.get<std::uint8_t>();
    const auto file = std::next(files.begin(), which % 128 % static_cast<std::ptrdiff_t>(files.size()));
    if (which >= 128)
      files.erase(file);
    else
      patch(file->second, in);
  }
  const std::string map = kFolder / "damaged/map", work = kFolder / "work", copy = kFolder / "copy";
  write(map, files);
  fs::remove_all(work);
  fs::remove_all(copy);
  const auto saved = salvage_store(map, work, copy, {}, {});
  must(files_in(map) == files);
  if (!saved.ok()) {
    must(saved.reason() == Reason::DATA_LOSS || saved.reason() == Reason::IO_ERROR);
    return 0;
  }
  must(!saved->sound || saved->lost == 0);
  const auto head = read_store_head(saved->sound ? map : copy);
  must(head.ok());
  return 0;
}
