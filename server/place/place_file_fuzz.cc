// Any bytes as the file of places: what of it can be used is loaded, and the rest is cut off, with a named reason; the
// index then answers, grows, and is saved and loaded again alike. If the first byte is odd, the file's header is put
// before the bytes, and they are blocks, each with two bytes of length: their checksums are right, so that what is
// behind them is reached.
#include <filesystem>
#include <string>

#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "server/place/inverted_index.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::place;
using fuzzing::must;

constexpr std::uint32_t kVocabularyCrc = 4711;
constexpr SessionNumber kSessions = 5;  // of the map
constexpr FrameId kNew{kSessions + 1, 0};

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
  for (ByteReader in(bytes); in.ok() && in.remaining() > 0;) {
    const auto length = in.get<std::uint16_t>();
    const ByteSpan block = fuzzing::take_up_to(in, length);
    w.put(static_cast<std::uint32_t>(block.size()));
    w.put(crc32c(block));
    w.put_bytes(block);
  }
  return w.take();
}

// Places that are left out get no value, and all others the same as without.
void check_masked(Model& model, const InvertedIndex& index, const PlaceScores& all) {
  std::vector<storage::FrameRange> masked;
  for (std::uint32_t place = 0; place < index.size(); place += 1 + index.size() / 3)
    masked.push_back({all.frame(place).session, all.frame(place).index, all.frame(place).index + 2});
  masked.push_back({kNew.session, 0, 5});
  PlaceScores scores;
  index.score(model.query, masked, scores);
  std::size_t candidates = 0;
  for (std::uint32_t place = 0; place < index.size(); ++place) {
    const bool left_out = storage::within(scores.frame(place), masked);
    must(scores.values[place] == (left_out ? kLeftOut : all.values[place]));
    candidates += left_out ? 0 : 1;
  }
  must(scores.candidates == candidates);
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
  fuzzing::write_file(PlaceFile::folder_in(folder) + "/blocks", file);
  const auto in_map = [](const FrameRun& run) { return run.first.session <= kSessions; };
  // Another allowance leaves the blocks in the file, from which each query then reads them.
  InvertedIndex::Options options;
  options.folder = folder;
  options.vocabulary_crc = kVocabularyCrc;
  if (data[0] & 2u) options.allowance = std::size_t{1} << 16;
  std::uint32_t places = 0;
  {
    InvertedIndex index(model.terms, options);
    must(fuzzing::is_one_of(index.restore(in_map).reason(),
                            {Reason::OK, Reason::CORRUPT, Reason::TRUNCATED, Reason::DATA_LOSS, Reason::NO_SUCH_FRAME,
                             Reason::UNKNOWN_FORMAT_VERSION, Reason::WRONG_VOCABULARY}));
    PlaceScores scores;
    index.score(model.query, {}, scores);
    must(scores.values.size() == index.size());
    for (std::uint32_t place = 0; place < index.size(); ++place)
      must(in_map({scores.frame(place), 1, 0}) && scores.find(scores.frame(place)) == place);
    check_masked(model, index, scores);
    if (index.size() > 0) must(index.contains(scores.frame(index.size() / 2)));
    scores.end();
    must(!index.contains(kNew) && scores.tail.empty());
    const Status added = index.add(kNew, sorted_unique(std::vector<std::uint32_t>{7, 1, 2, 7}));
    must(added.ok() ? index.contains(kNew) : added.reason() == Reason::BUDGET_EXCEEDED);
    index.score(model.query, {}, scores);
    must(!added.ok() || scores.find(kNew) + 1 == index.size());
    check_masked(model, index, scores);
    must(scores.find({kNew.session, 1}) == FrameTable::kNone);
    scores.end();
    must(index.save().ok());
    places = index.size();
  }
  InvertedIndex again(model.terms, options);
  must(again.restore([](const FrameRun&) { return true; }).ok() && again.size() == places);
  return 0;
}
