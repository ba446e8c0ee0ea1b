// Any bytes as the file of places: what of it can be used is loaded, and the rest is cut off by name; the index then
// answers, grows, and is saved and loaded again alike. If the first byte is odd, the file's header is put before the
// bytes, and they are blocks, each with two bytes of length: their checksums are right, so that what is behind them is
// reached.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "proto/base/crc32c.h"
#include "server/place/inverted_index.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::place;

constexpr std::uint32_t kVocabularyCrc = 4711;
constexpr SessionNumber kSessions = 5;  // of the map
constexpr FrameId kNew{kSessions + 1, 0};

void must(bool holds) {
  if (!holds) std::abort();
}

struct Model {
  std::shared_ptr<const Vocabulary> vocabulary = random_vocabulary(300, 1, 1);
  FabMapModel terms{*vocabulary};
  BlockScores query{terms};
  Model() { query.ask(std::vector<std::uint32_t>{1, 2, 7, 150, 299}); }
};

Bytes whole_blocks(ByteSpan bytes) {
  ByteWriter w;
  w.put_bytes(as_bytes("RELMAPPL"));
  w.put(PlaceFile::kVersion);
  w.put(kVocabularyCrc);
  for (ByteReader in(bytes); in.remaining() > 0;) {
    const auto length = in.get<std::uint16_t>();
    const ByteSpan block = in.get_bytes(std::min<std::size_t>(length, in.remaining()));
    w.put(static_cast<std::uint32_t>(block.size()));
    w.put(crc32c(block));
    w.put_bytes(block);
  }
  return w.take();
}

bool is_named(Reason reason) {
  switch (reason) {
    case Reason::OK:
    case Reason::CORRUPT:
    case Reason::TRUNCATED:
    case Reason::DATA_LOSS:
    case Reason::NO_SUCH_FRAME:
    case Reason::UNKNOWN_FORMAT_VERSION:
    case Reason::WRONG_VOCABULARY:
      return true;
    default:
      return false;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static Model model;
  static const storage::TemporaryFolder kFolder;
  const std::string folder = kFolder / "map";
  std::filesystem::create_directories(PlaceFile::folder_in(folder));
  const ByteSpan bytes(data + 1, size - 1);
  const Bytes file = data[0] % 2 == 1 ? whole_blocks(bytes) : Bytes(bytes.begin(), bytes.end());
  {
    std::ofstream out(PlaceFile::folder_in(folder) + "/blocks", std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
    must(out.flush().good());
  }
  const auto in_map = [](const FrameRun& run) { return run.first.session <= kSessions; };
  // Another allowance leaves the blocks in the file, from which each query then reads them.
  InvertedIndex::Options options;
  options.folder = folder;
  options.vocabulary_crc = kVocabularyCrc;
  if (data[0] & 2u) options.allowance = std::size_t{1} << 16;
  std::uint32_t places = 0;
  {
    InvertedIndex index(model.terms, options);
    must(is_named(index.restore(in_map).reason()));
    PlaceScores scores;
    index.score(model.query, {}, scores);
    must(scores.values.size() == index.size());
    for (std::uint32_t place = 0; place < index.size(); ++place)
      must(in_map({scores.frame(place), 1, 0}) && scores.find(scores.frame(place)) == place);
    scores.end();
    if (const Status added = index.add(kNew, {1, 2, 7}); !added.ok()) must(added.reason() == Reason::BUDGET_EXCEEDED);
    must(index.save().ok());
    places = index.size();
  }
  InvertedIndex again(model.terms, options);
  must(again.restore([](const FrameRun&) { return true; }).ok() && again.size() == places);
  return 0;
}
