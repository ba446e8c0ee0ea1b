// Any changes to the files of a small map's store, and any of them missing: what can be saved is, in a store that can
// be read, or there is a reason why not; the damaged store stays as it is. Each change is a byte that chooses the file,
// and a patch; with the highest bit the file is removed instead.
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "proto/base/testing/fuzzing.h"
#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/rocksdb/salvage.h"
#include "storage/testing/patches.h"
#include "storage/testing/random_frames.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;
namespace fs = std::filesystem;

constexpr std::size_t kChanges = 8;
constexpr std::uint32_t kChunks = 2, kFrames = 3;  // chunks of a session, frames of a chunk
constexpr std::size_t kPicture = 5000;             // larger than what RocksDB keeps in tables

using Files = std::map<std::string, Bytes>;

Files files_in(const std::string& folder) {
  Files files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (!entry.is_regular_file() || name == "LOCK" || name.starts_with("LOG")) continue;
    files[name] = fuzzing::read_file(entry.path());
  }
  return files;
}

void write(const std::string& folder, const Files& files) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const auto& [name, bytes] : files) fuzzing::write_file(folder + "/" + name, bytes);
}

// A chunk with a few frames, in containers as they stand when it is open or closed; the cold parts become blobs.
void put_chunk(std::vector<Put>& puts, RandomFrames& random, ChunkId chunk, bool closed) {
  PartWriter hot(Part::kHot, chunk, 1), warm(Part::kWarm, chunk, 1);
  for (std::uint32_t slot = 0; slot < kFrames; ++slot) {
    const FrameId id = frame_in(chunk, slot);
    ByteWriter h, w, c;
    encode_hot(h, id, random.hot(id));
    encode_warm(w, id, random.warm());
    FrameCold cold = random.cold();
    cold.picture.assign(kPicture, static_cast<std::uint8_t>(slot));
    encode_cold(c, cold);
    if (closed) {
      hot.add(slot, h.bytes());
      warm.add(slot, w.bytes());
    } else {
      puts.push_back({keys::frame(Part::kHot, id), frame_container(Part::kHot, id, 1, h.bytes())});
      puts.push_back({keys::frame(Part::kWarm, id), frame_container(Part::kWarm, id, 1, w.bytes())});
    }
    puts.push_back({keys::frame(Part::kCold, id), frame_container(Part::kCold, id, 1, c.bytes())});
  }
  if (!closed) return;
  puts.push_back({keys::part(Part::kHot, chunk), hot.finish()});
  puts.push_back({keys::part(Part::kWarm, chunk), warm.finish()});
}

// A store of two sessions, of which a part is compacted and the rest in a later table and in RocksDB's own log.
Files make_store(const std::string& data) {
  {
    RocksDbOptions options;
    options.cache_bytes = std::size_t{8} << 20;
    const auto engine = open_rocksdb(data, options).or_throw();
    const std::uint64_t epoch = engine->acquire().or_throw();
    RandomFrames random(1);
    std::uint64_t applied = 0;
    for (const SessionNumber number : {1, 2}) {
      must(engine->allocate_session(epoch).or_throw() == number);
      for (std::uint32_t chunk = 0; chunk < kChunks; ++chunk) {
        std::vector<Put> puts;
        put_chunk(puts, random, {number, chunk}, chunk + 1 < kChunks);
        Session session = random.session(number);
        session.first = 0;
        session.last = chunk * kFramesPerChunk + kFrames - 1;
        session.frames = (chunk + 1) * kFrames;
        puts.push_back({keys::session(number), encode_session(session)});
        const Skipped skipped = random.skipped();
        puts.push_back({keys::skipped(number, skipped.to), encode_skipped(skipped)});
        puts.push_back({keys::label("hall", {number, chunk}), {}});
        puts.push_back({std::string("\x7f", 1) + "later", Bytes(10, 1)});
        MapState state;
        state.applied_sequence = applied;
        puts.push_back({keys::map_state(), encode_state(state)});
        const Bytes record(10, 1);
        applied = engine->append(epoch, {&record, 1}).or_throw();
        must(engine->commit(epoch, applied, puts, {}).ok());
      }
      if (number == 1) must(engine->compact([](std::uint64_t, std::uint64_t) { return Status(); }).ok());
    }
  }
  return files_in(data + "/map");
}

// Everything in the store of `data` can be read.
std::set<std::string> keys_in(const std::string& data) {
  RocksDbOptions options;
  options.cache_bytes = std::size_t{8} << 20;
  options.read_only = true;
  const auto engine = open_rocksdb(data, options);
  must(engine.ok(), engine.status().to_string());
  std::set<std::string> keys;
  const Status scanned = (*engine)->snapshot()->scan("", [&](std::string_view key, ByteSpan) {
    must(keys.insert(std::string(key)).second);
    return true;
  });
  must(scanned.ok(), scanned.to_string());
  return keys;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TemporaryFolder kFolder;
  static const Files kSound = make_store(kFolder / "sound");
  static const std::set<std::string> kKeys = keys_in(kFolder / "sound");
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
  const std::string map = kFolder / "damaged/map", work = kFolder / "work", copy = kFolder / "saved/map";
  write(map, files);
  fs::remove_all(work);
  fs::remove_all(copy);
  fs::create_directories(kFolder / "saved");
  for (const char* folder : {"damaged", "saved"}) {  // the rest of a data folder, which salvage leaves alone
    fs::create_directories(kFolder / (std::string(folder) + "/journal"));
    fs::copy_file(kFolder / "sound/FORMAT", kFolder / (std::string(folder) + "/FORMAT"),
                  fs::copy_options::skip_existing);
  }
  const auto saved = salvage_store(map, work, copy, {}, {});
  must(files_in(map) == files);
  if (!saved.ok()) {
    must(saved.reason() == Reason::DATA_LOSS || saved.reason() == Reason::IO_ERROR);
    return 0;
  }
  must(!saved->sound || saved->lost == 0);
  must(read_store_head(saved->sound ? map : copy).ok());
  const auto keys = keys_in(kFolder / (saved->sound ? "damaged" : "saved"));
  must(std::includes(kKeys.begin(), kKeys.end(), keys.begin(), keys.end()));
  must(saved->sound || keys.size() <= saved->copied);
  return 0;
}
