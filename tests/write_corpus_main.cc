// Writes the inputs from which fuzzers of binary files and messages start: sound ones, and ones with one fault each.
// Each run writes the same. The other inputs of tests/corpus are texts that were written by hand, what fuzzing has
// found (tools/fuzz --keep), and what once caused a failure.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "frontend/publishing/disk_spool.h"
#include "proto/base/crc32c.h"
#include "server/place/place_block.h"
#include "server/place/place_file.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/format/chunk_codec.h"
#include "storage/format/keys.h"
#include "storage/rocksdb/manifest_log.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tests/write_corpus.h"

namespace {

using namespace relmap;
using fuzzing::read_file;
using testing::Corpus;
using testing::cut;
namespace fs = std::filesystem;

// The records of a spool's segments as spool_fuzz reads them: each behind a byte with its length.
class SpoolRecords {
 public:
  SpoolRecords& keyframe(std::uint32_t sequence, std::string_view payload) {
    w_.put(static_cast<std::uint8_t>(5 + payload.size()));
    w_.put(std::uint8_t{1});
    w_.put(sequence);
    w_.put_bytes(as_bytes(payload));
    return *this;
  }
  SpoolRecords& gap(std::uint32_t from, std::uint32_t to) {
    w_.put(static_cast<std::uint8_t>(9 + sizeof(Reason)));
    w_.put(std::uint8_t{2});
    w_.put(from);
    w_.put(to);
    w_.put(Reason::DROPPED_BY_ROBOT);
    return *this;
  }
  SpoolRecords& any(std::initializer_list<std::uint8_t> bytes) {
    w_.put(static_cast<std::uint8_t>(bytes.size()));
    for (const std::uint8_t byte : bytes) w_.put(byte);
    return *this;
  }
  SpoolRecords& next_segment() {
    w_.put(std::uint8_t{255});
    return *this;
  }
  const Bytes& bytes() const { return w_.bytes(); }

 private:
  ByteWriter w_;
};

void write_spool(const std::string& root) {
  enum File { kSegments, kSegmentAsItIs, kSession, kSessionAsItIs, kMap, kRecording, kNames };
  const Corpus corpus(root, "spool_fuzz");
  corpus.add(
      "segments", {kSegments},
      SpoolRecords().keyframe(0, "first").keyframe(1, "second").gap(2, 4).next_segment().keyframe(5, "").bytes());
  corpus.add("sequence_twice", {kSegments},
             SpoolRecords().keyframe(3, "one").next_segment().keyframe(3, "the other").bytes());
  corpus.add("last_sequence", {kSegments}, SpoolRecords().keyframe(~0u, "last").gap(1, ~0u).bytes());
  corpus.add("short_records", {kSegments}, SpoolRecords().any({1}).any({1, 2}).any({2, 1, 0}).any({}).bytes());
  corpus.add("unknown_kind", {kSegments}, SpoolRecords().any({9, 1, 2, 3}).keyframe(1, "known").bytes());

  const storage::TemporaryFolder folder;
  SessionHeader header;
  header.uuid.bytes = {1, 2, 3};
  header.robot = "cart";
  header.name = "morning";
  header.camera = {700, 320, 240, 0.5, 640, 480};
  for (const bool raw : {false, true}) {
    if (raw) {
      StereoCalibration calibration;
      calibration.left = calibration.right = {700, 701, 320, 240, -0.1, 0.01, 0, 0, 0};
      calibration.T_right_left.t.x() = -0.5;
      calibration.width = 640;
      calibration.height = 480;
      header.raw = calibration;
    }
    const std::string spool = folder / (raw ? "raw" : "rectified"), name = raw ? "_raw" : "";
    const auto opened = publishing::DiskSpool::open(spool, header, "kitti /drive --every 1");
    throw_if(opened.ok() ? (*opened)->append(0, as_bytes("a keyframe"), crc32c(as_bytes("a keyframe")))
                         : opened.status());
    const Bytes session = read_file(spool + "/session"), segment = read_file(spool + "/0000000000.seg");
    corpus.add("session" + name, {kSessionAsItIs}, session);
    corpus.add("session_cut" + name, {kSessionAsItIs}, cut(session, 3));
    corpus.add("session_body" + name, {kSession}, cut(session, 4));
    corpus.add("session_body_cut" + name, {kSession}, cut(session, 12));
    if (raw) continue;
    corpus.add("segment", {kSegmentAsItIs}, segment);
    corpus.add("segment_torn", {kSegmentAsItIs}, cut(segment, 5));
    Bytes changed = session;
    changed[4] = 9;
    corpus.add("session_version", {kSession}, cut(changed, 4));
    changed = session;
    changed[50] ^= 1;
    corpus.add("session_of_another_camera", {kSession}, cut(changed, 4));
    changed = session;
    changed[24] ^= 1;
    corpus.add("session_of_another_robot", {kSession}, cut(changed, 4));
    changed = segment;
    changed[4] = 2;
    corpus.add("segment_version", {kSegmentAsItIs}, changed);
  }
  corpus.add("no_session", {kSessionAsItIs}, as_bytes("SPLS is not it"));
  corpus.add("map", {kMap}, as_bytes("00000000-0000-4000-8000-000000000001 17\n"));
  corpus.add("map_nil", {kMap}, as_bytes("00000000-0000-0000-0000-000000000000 17\n"));
  corpus.add("map_without_epoch", {kMap}, as_bytes("00000000-0000-4000-8000-000000000001"));
  corpus.add("same_recording", {kRecording}, as_bytes("kitti /drive --every 1"));
  corpus.add("another_recording", {kRecording}, as_bytes("kitti /other --every 2"));
  corpus.add("number_too_large", {kNames}, as_bytes("9999999999"));
  corpus.add("last_number", {kNames}, as_bytes("4294967295"));
}

void write_places(const std::string& root) {
  enum How { kAsItIs, kBlocks, kAsItIsInLittleMemory, kBlocksInLittleMemory };
  const Corpus corpus(root, "place_file_fuzz");
  const auto vocabulary = place::random_vocabulary(300, 1, 1);
  const place::FabMapModel model(*vocabulary);
  const auto block = [&](SessionNumber session, std::uint32_t first, std::uint32_t places) {
    std::vector<place::PlaceWords> words;
    for (std::uint32_t i = 0; i < places; ++i) words.push_back({{session, first + i}, {i % 300}});
    return place::encode_place_block(model, nullptr, words);
  };
  const auto with_length = [](std::initializer_list<Bytes> blocks) {
    ByteWriter w;
    for (const Bytes& one : blocks) {
      w.put(static_cast<std::uint16_t>(one.size()));
      w.put_bytes(one);
    }
    return w.take();
  };
  const Bytes small = block(1, 0, 5), full = block(2, 0, place::kPlacesPerBlock);
  if (full.size() > 65535) std::abort();
  corpus.add("one_block", {kBlocks}, with_length({small}));
  corpus.add("a_full_block_and_another", {kBlocks}, with_length({full, small}));
  corpus.add("in_the_file_only", {kBlocksInLittleMemory}, with_length({full, small}));
  corpus.add("frames_twice", {kBlocks}, with_length({full, block(2, 4095, 3)}));
  corpus.add("behind_the_last", {kBlocks}, with_length({small, block(3, 0, 2)}));
  corpus.add("not_in_the_map", {kBlocks}, with_length({block(9, 0, 2)}));
  corpus.add("malformed_block", {kBlocks}, with_length({cut(small, 7)}));
  const auto file = [&](std::string_view magic, std::uint32_t version, std::uint32_t vocabulary_crc) {
    ByteWriter w;
    w.put_bytes(as_bytes(magic));
    w.put(version);
    w.put(vocabulary_crc);
    w.put(static_cast<std::uint32_t>(small.size()));
    w.put(crc32c(small));
    w.put_bytes(small);
    return w.take();
  };
  constexpr std::uint32_t kVocabulary = 4711;  // of the fuzzer
  const Bytes sound = file("RELMAPPL", place::PlaceFile::kVersion, kVocabulary);
  corpus.add("sound", {kAsItIs}, sound);
  corpus.add("empty", {kAsItIs});
  corpus.add("header_cut", {kAsItIs}, ByteSpan(sound).first(9));
  corpus.add("torn", {kAsItIs}, cut(sound, 5));
  corpus.add("length_torn", {kAsItIs}, ByteSpan(sound).first(19));
  corpus.add("other_magic", {kAsItIs}, file("RELMAPPX", place::PlaceFile::kVersion, kVocabulary));
  corpus.add("other_version", {kAsItIs}, file("RELMAPPL", 1, kVocabulary));
  corpus.add("other_vocabulary", {kAsItIs}, file("RELMAPPL", place::PlaceFile::kVersion, 1));
  Bytes damaged = sound;
  damaged.back() ^= 1;
  corpus.add("damaged", {kAsItIs}, damaged);

  const Corpus blocks(root, "place_block_fuzz");
  blocks.add("small", {}, small);
  blocks.add("small_cut", {}, cut(small, 1));
  blocks.add("small_and_more", {}, block(1, 0, 70));
  std::vector<place::PlaceWords> places;  // two runs of frames, and common words
  for (std::uint32_t i = 0; i < 40; ++i) places.push_back({{i < 20 ? 3u : 4u, 7 + i}, {1, 2, 10 + i, 299}});
  const Bytes two_runs = place::encode_place_block(model, nullptr, places);
  blocks.add("two_runs", {}, two_runs);
  for (std::size_t at = 0; at < std::min<std::size_t>(two_runs.size(), 200); at += 4) {
    Bytes changed = two_runs;
    changed[at] ^= 0x81;
    blocks.add("changed_at_" + std::to_string(at), {}, changed);
  }
}

void write_routes(const std::string& root) {
  enum How { kTable, kTableChanged, kCellsChanged, kCellsDamaged };
  const Corpus corpus(root, "route_table_fuzz");
  corpus.add("sound", {kTableChanged});
  corpus.add("none", {kTable});
  corpus.add("short_table", {kTable}, as_bytes("RELMAPRT"));
  corpus.add("other_magic", {kTable}, as_bytes("RELMAPRX0123456789abcdef"));
  // Changes: kind (0 xor of a byte, 1 a number, 3 cut), u24 offset, value.
  corpus.add("other_commit", {kTableChanged, 0, 0, 0, 0, 1});
  corpus.add("many_stale_chunks", {kTableChanged, 1, 8, 0, 0, 255, 255, 255, 255});
  corpus.add("other_metric", {kTableChanged, 0, 27, 0, 0, 64});
  corpus.add("tree_cut", {kTableChanged, 3, 200, 0, 0});
  corpus.add("table_cut", {kTableChanged, 3, 0, 4, 0});
  corpus.add("cells_sound", {kCellsChanged});
  corpus.add("cell_damaged", {kCellsDamaged, 0, 9, 0, 0, 1});
  corpus.add("cell_with_other_frame", {kCellsChanged, 0, 8, 0, 0, 1});
  corpus.add("cells_cut", {kCellsChanged, 3, 0, 4, 0});
}

void write_manifest(const std::string& root) {
  const Corpus corpus(root, "manifest_fuzz");
  const auto log = [](std::initializer_list<std::size_t> sizes, std::string_view last = {}) {
    ByteWriter w;
    for (const std::size_t size : sizes) storage::put_log_record(w, Bytes(size, 7));
    if (!last.empty()) storage::put_log_record(w, as_bytes(last));
    return w.take();
  };
  constexpr std::string_view kCold =
      "\xc9\x01\x04"
      "cold";
  corpus.add("records", {0}, log({1, 20, 0, 5}));
  corpus.add("blobs_behind_their_family", {2}, log({10, 3}, kCold));
  corpus.add("blobs_without_family", {3}, log({70}));
  corpus.add("across_blocks", {1}, log({32750, 40}));
  corpus.add("at_the_end_of_a_block", {1}, log({32768 - 7 - 3, 9}));
  corpus.add("cut", {1}, cut(log({10, 20}), 4));
  Bytes many;  // "last" pieces without a first one
  for (int i = 0; i < 200; ++i) many.insert(many.end(), {0, 0, 0, 0, 1, 0, 4, 9});
  corpus.add("last_pieces", {0}, many);
  corpus.add("unknown_type", {0}, Bytes{0, 0, 0, 0, 0, 0, 9});
}

void write_salvage(const std::string& root) {
  const Corpus corpus(root, "salvage_fuzz");
  // Each takes a tenth of a second and more, so there are few. A change is the number of a file, of which the first
  // are tables and blobs and the list of files comes later; 128 more removes it.
  corpus.add("sound", {});
  for (int file = 0; file < 10; ++file) {
    const std::string number = std::to_string(file);
    corpus.add("without_file_" + number, {128 + file});
    corpus.add("flipped_" + number, {file, 0, 40 + 60 * (file % 3), 0, 0, 32});
  }
  corpus.add("without_lists", {128 + 5, 128 + 5, 128 + 5});
  corpus.add("cut", {1, 3, 100, 0, 0, 2, 3, 100, 0, 0});
}

// The smallest record of each kind that is not empty, of a map that was made by format 1.
void write_format1(const std::string& root) {
  enum Kind { kHot, kWarm, kCold, kWords, kSession, kState };
  const Corpus corpus(root, "format1_fuzz");
  const storage::TemporaryFolder folder;
  const std::string map = folder / "map";
  fs::create_directory(map);
  const std::string unpack = "tar -C " + map + " -xJf " RELMAP_SOURCE_DIR "/tests/fixtures/map-format-1.tar.xz";
  if (std::system(unpack.c_str()) != 0) std::abort();
  storage::RocksDbOptions options;
  options.format = 1;
  options.read_only = true;
  const auto engine = storage::open_rocksdb(map, options).or_throw();
  std::map<std::pair<int, bool>, Bytes> chosen;  // by kind; the smallest, and the largest
  const auto consider = [&](int kind, ByteSpan body) {
    for (const bool largest : {false, true}) {
      if (body.size() <= 4 || (largest && body.size() > 20'000)) continue;
      Bytes& best = chosen[{kind, largest}];
      if (best.empty() || (largest ? body.size() > best.size() : body.size() < best.size()))
        best.assign(body.begin(), body.end());
    }
  };
  throw_if(engine->snapshot()->scan("", [&](std::string_view key, ByteSpan value) {
    if (const auto part = storage::keys::part_of(key)) {
      const auto reader = storage::PartReader::open(value, part->part, part->chunk, 1).or_throw();
      const int kind = part->part == storage::Part::kHot    ? kHot
                       : part->part == storage::Part::kWarm ? kWarm
                       : part->part == storage::Part::kCold ? kCold
                                                            : kWords;
      for (std::size_t i = 0; i < reader.size(); ++i) consider(kind, reader.body(i).or_throw());
    } else if (key.starts_with(storage::keys::all_sessions())) {
      consider(kSession, value);
    } else if (key == storage::keys::map_state()) {
      consider(kState, value);
    }
    return true;
  }));
  static constexpr const char* kNames[] = {"hot", "warm", "cold", "words", "session", "state"};
  for (const auto& [which, bytes] : chosen) {
    const std::string name = std::string(kNames[which.first]) + (which.second ? "_large" : "");
    corpus.add(name, {which.first}, bytes);
    corpus.add(name + "_cut", {which.first}, cut(bytes, 3));
    // Sealed records also as bodies, which the fuzzer seals: version, kind, length before, checksum behind.
    if (which.first >= kSession) corpus.add(name + "_body", {which.first}, ByteSpan(cut(bytes, 4)).subspan(8));
  }
}

// A few calls of each method with fields of chance.
void write_requests(const std::string& root) {
  constexpr int kMethods = 29, kEach = 6;
  const Corpus corpus(root, "rpc_request_fuzz");
  std::mt19937_64 random(1);
  for (int method = 0; method < kMethods; ++method)
    for (int i = 0; i < kEach; ++i) {
      Bytes fields(40);
      for (std::uint8_t& byte : fields) byte = static_cast<std::uint8_t>(random() >> 24);
      corpus.add("method_" + std::to_string(method) + "_" + std::to_string(i), {method, i == 0 ? 1 : 2 * (i + 1)},
                 fields);
    }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2 || argv[1][0] == '-') {
    std::fprintf(stderr, "usage: write_corpus FOLDER\n");
    return 2;
  }
  for (const auto write : {write_spool,
                           write_places,
                           write_routes,
                           write_manifest,
                           write_salvage,
                           write_format1,
                           write_requests,
                           testing::write_journal_segments,
                           testing::write_journal_records,
                           testing::write_chunks,
                           testing::write_event_blocks,
                           testing::write_raw_logs,
                           testing::write_keyframe_logs,
                           testing::write_keyframe_files,
                           testing::write_keyframes,
                           testing::write_ingest_parts,
                           testing::write_lcm_messages,
                           testing::write_questions,
                           testing::write_edits,
                           testing::write_replies})
    write(argv[1]);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
