#include "server/place/place_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "server/place/testing/hand_made_graph.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::place {
namespace {

// Words that do not depend on each other, so that pictures are easy to draw.
VocabularyModel independent_words(std::uint32_t words) {
  VocabularyModel model = random_vocabulary_model(words, 200, 1);
  model.given_parent_absent = model.given_parent_present = model.marginal;
  return model;
}

// Places along a chain, drawn from the vocabulary's own marginals; a tenth of the words changes from one to the next.
class Chain {
 public:
  explicit Chain(std::uint32_t frames, const StereoCamera& camera = kStereoCamera)
      : vocabulary(Vocabulary::from_bytes(encode_vocabulary(independent_words(500))).or_throw()),
        index(vocabulary),
        random_(2) {
    graph.add_session(1, camera);
    std::vector<std::uint32_t> current = draw();
    for (std::uint32_t i = 0; i < frames; ++i) {
      graph.add_frame({1, i});
      if (i > 0 && camera.is_stereo()) graph.add_edge({1, i - 1}, {1, i}, 0);
      (void)index.add({1, i}, current);
      words_of.push_back(current);
      current = changed(current, 0.1);
    }
  }
  std::vector<std::uint32_t> draw() { return changed({}, 1); }
  // The words that a camera sees when it returns to frame i: half the same, half others.
  std::vector<std::uint32_t> seen_again(std::uint32_t i) { return changed(words_of[i], 0.5); }

  std::shared_ptr<const Vocabulary> vocabulary;
  PlaceIndex index;
  HandMadeGraph graph;
  std::vector<std::vector<std::uint32_t>> words_of;

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  // Draws every word of the vocabulary anew with probability `share`.
  std::vector<std::uint32_t> changed(const std::vector<std::uint32_t>& words, double share) {
    std::vector<std::uint32_t> result;
    for (std::uint32_t w = 0; w < vocabulary->size(); ++w) {
      const bool fresh = uniform() < share;
      const bool drawn = uniform() < static_cast<double>(vocabulary->marginal()[w]);
      if (fresh ? drawn : std::binary_search(words.begin(), words.end(), w)) result.push_back(w);
    }
    return result;
  }
  std::mt19937_64 random_;
};

std::uint32_t apart(FrameId frame, std::uint32_t index) {
  return frame.index > index ? frame.index - index : index - frame.index;
}

bool same(const PlaceAnswer& a, const PlaceAnswer& b) {
  return a.new_place == b.new_place &&
         std::equal(a.candidates.begin(), a.candidates.end(), b.candidates.begin(), b.candidates.end(),
                    [](const PlaceCandidate& x, const PlaceCandidate& y) {
                      return x.frame == y.frame && x.probability == y.probability;
                    });
}

TEST(PlaceIndex, AnEmptyMapHoldsNoPlace) {
  Chain chain(0);
  const PlaceAnswer answer = chain.index.query(chain.draw(), chain.graph);
  EXPECT_TRUE(answer.candidates.empty());
  EXPECT_EQ(answer.new_place, 1);
}

TEST(PlaceIndex, WhereWordsAreIndependentOnlyThoseThatAreShownTell) {
  Chain chain(200);
  for (const std::uint32_t i : {20, 90, 150}) {
    const std::vector<std::uint32_t> words = chain.seen_again(i);
    const PlaceAnswer answer = chain.index.query(words, chain.graph);
    ASSERT_FALSE(answer.candidates.empty());
    EXPECT_TRUE(same({chain.index.by_shown_words(words, chain.graph, {}), answer.new_place}, answer)) << i;
    const storage::FrameRange left_out[] = {{1, 0, 200}};
    EXPECT_TRUE(chain.index.by_shown_words(words, chain.graph, left_out).empty());
  }
  EXPECT_TRUE(chain.index.by_shown_words({}, chain.graph, {}).empty());
}

TEST(PlaceIndex, APictureWithoutWordsIsANewPlace) {
  Chain chain(20);
  const PlaceAnswer answer = chain.index.query({}, chain.graph);
  EXPECT_TRUE(answer.candidates.empty());
  EXPECT_EQ(answer.new_place, 1);
}

TEST(PlaceIndex, FindsThePlaceSeenAgain) {
  Chain chain(200);
  for (const std::uint32_t i : {10u, 77u, 150u, 199u}) {
    const PlaceAnswer answer = chain.index.query(chain.seen_again(i), chain.graph);
    ASSERT_FALSE(answer.candidates.empty());
    EXPECT_LE(apart(answer.candidates[0].frame, i), 2u);
    EXPECT_GT(answer.candidates[0].probability, 0.9);
    EXPECT_LT(answer.new_place, 0.05);
  }
}

TEST(PlaceIndex, KnowsThatAPlaceIsNew) {
  Chain chain(200);
  double mean = 0;
  for (int i = 0; i < 20; ++i) mean += chain.index.query(chain.draw(), chain.graph).new_place / 20;
  EXPECT_GT(mean, 0.75);
}

TEST(PlaceIndex, ProbabilitiesSumToAtMostOneAndDescend) {
  Chain chain(200);
  const PlaceAnswer answer = chain.index.query(chain.seen_again(100), chain.graph);
  double sum = answer.new_place;
  for (std::size_t i = 0; i < answer.candidates.size(); ++i) {
    sum += answer.candidates[i].probability;
    EXPECT_GE(answer.candidates[i].probability, 1e-3);
    if (i > 0) {
      EXPECT_LE(answer.candidates[i].probability, answer.candidates[i - 1].probability);
    }
  }
  EXPECT_LE(sum, 1 + 1e-12);
  EXPECT_LE(answer.candidates.size(), 20u);
}

TEST(PlaceIndex, WhereTheQueryIsThoughtToBeIsLikelier) {
  Chain chain(200);
  // Frame 150 again but far away, so that two places look the same.
  for (std::uint32_t i = 300; i < 340; ++i) {
    chain.graph.add_frame({1, i});
    if (i > 300) chain.graph.add_edge({1, i - 1}, {1, i}, 0);
    ASSERT_TRUE(chain.index.add({1, i}, i == 320 ? chain.words_of[150] : chain.draw()).ok());
  }
  const auto query = chain.seen_again(150);
  const auto ask = [&](std::optional<FrameId> near) { return chain.index.query(query, chain.graph, {}, near); };
  const auto probability = [](const PlaceAnswer& answer, std::uint32_t index) {
    for (const PlaceCandidate& candidate : answer.candidates)
      if (apart(candidate.frame, index) <= 5) return candidate.probability;
    return 0.0;
  };
  const PlaceAnswer anywhere = ask(std::nullopt), here = ask(FrameId{1, 145}), there = ask(FrameId{1, 325});
  EXPECT_GT(probability(anywhere, 320), 0.2);
  EXPECT_GT(probability(anywhere, 150), 0.2);
  EXPECT_EQ(here.candidates.at(0).frame.index / 100, 1u);
  EXPECT_GT(probability(here, 150), 0.9);
  EXPECT_EQ(there.candidates.at(0).frame, (FrameId{1, 320}));
  EXPECT_GT(probability(there, 320), 0.9);
  for (const PlaceAnswer& answer : {anywhere, here, there}) {
    double sum = answer.new_place;
    for (const PlaceCandidate& candidate : answer.candidates) sum += candidate.probability;
    EXPECT_NEAR(sum, 1, 0.03) << "of the rest each has less than 1e-3";
    EXPECT_LE(sum, 1 + 1e-12);
  }
  // The expectation alone is not enough: the place must look similar, too.
  EXPECT_GT(probability(ask(FrameId{1, 20}), 150) + probability(ask(FrameId{1, 20}), 320), 0.9);
  EXPECT_TRUE(same(ask(FrameId{7, 0}), anywhere)) << "near a frame that is no place";
}

TEST(PlaceIndex, MassIsSummedOverGraphNeighbours) {
  // All frames have the same words, so each is as likely as the next, and only together do they stand for a place.
  const auto vocabulary = random_vocabulary(500, 50, 1);
  PlaceIndex index(vocabulary);
  HandMadeGraph graph;
  graph.add_session(1, kStereoCamera);
  std::vector<std::uint32_t> words;
  for (std::uint32_t w = 0; w < 40; ++w) words.push_back(11 * w);
  for (std::uint32_t i = 0; i < 11; ++i) {
    graph.add_frame({1, i});
    if (i > 0) graph.add_edge({1, i - 1}, {1, i}, 0);
    (void)index.add({1, i}, words);
  }
  const PlaceAnswer answer = index.query(words, graph);
  ASSERT_GE(answer.candidates.size(), 2u);
  EXPECT_EQ(answer.candidates[0].frame, (FrameId{1, 0})) << "of equals the first";
  EXPECT_NEAR(answer.candidates[0].probability, answer.candidates[1].probability * 6 / 5, 1e-9)
      << "frames 0..5 against 6..10";
}

TEST(PlaceIndex, InAMonoSessionConsecutiveFramesAreNeighbours) {
  Chain chain(50, kMonoCamera);
  const PlaceAnswer answer = chain.index.query(chain.words_of[25], chain.graph);
  ASSERT_EQ(answer.candidates.size(), 1u);
  EXPECT_GT(answer.candidates[0].probability, 0.9);
}

TEST(PlaceIndex, MaskedFramesAreLeftOutOfTheSum) {
  Chain chain(120);
  const auto query = chain.seen_again(115);
  const PlaceAnswer answer = chain.index.query(query, chain.graph, std::vector<storage::FrameRange>{{1, 80, 119}});
  for (const PlaceCandidate& candidate : answer.candidates) EXPECT_LT(candidate.frame.index, 80u);
  EXPECT_GT(answer.new_place, 0.9);
  EXPECT_EQ(chain.index.query(query, chain.graph, std::vector<storage::FrameRange>{{1, 0, 60}, {1, 30, ~0u}}).new_place,
            1);
  EXPECT_TRUE(same(chain.index.query(query, chain.graph, std::vector<storage::FrameRange>{{2, 0, ~0u}, {1, 120, 500}}),
                   chain.index.query(query, chain.graph)))
      << "no frame of these is a place";
}

TEST(PlaceIndex, AFrameIsAddedOnce) {
  Chain chain(10);
  (void)chain.index.add({1, 3}, chain.words_of[3]);
  EXPECT_EQ(chain.index.size(), 10u);
}

TEST(PlaceIndex, AnswersDoNotDependOnTheOrderOfAdding) {
  Chain chain(5000);
  PlaceIndex reversed(chain.vocabulary);
  for (std::uint32_t i = 5000; i-- > 0;) (void)reversed.add({1, i}, chain.words_of[i]);
  for (const std::uint32_t i : {5u, 1200u, 4900u}) {
    const auto query = chain.seen_again(i);
    EXPECT_TRUE(same(chain.index.query(query, chain.graph), reversed.query(query, chain.graph))) << "bit for bit";
  }
}

TEST(PlaceIndex, TheMapsOwnPlacesStandForTheUnknownWorld) {
  // These words are at no shipped place but everywhere in this map, so only its own places show that they are common.
  VocabularyModel model = independent_words(100);
  for (auto& place : model.sample_places) std::erase_if(place, [](std::uint32_t w) { return w < 30; });
  const auto vocabulary = Vocabulary::from_bytes(encode_vocabulary(model)).or_throw();
  std::mt19937_64 random(4);
  const auto picture = [&] {
    std::vector<std::uint32_t> words;
    for (std::uint32_t w = 0; w < 100; ++w)
      if (static_cast<double>(random() % 1000) < (w < 30 ? 700.0 : 1000.0 * static_cast<double>(model.marginal[w])))
        words.push_back(w);
    return words;
  };
  for (const std::uint32_t places : {100u, 2100u}) {
    PlaceIndex index(vocabulary);
    HandMadeGraph graph;
    graph.add_session(1, kStereoCamera);
    for (std::uint32_t i = 0; i < places; ++i) {
      graph.add_frame({1, i});
      (void)index.add({1, i}, picture());
    }
    double mean = 0;
    for (int i = 0; i < 10; ++i) mean += index.query(picture(), graph).new_place / 10;
    EXPECT_GT(mean, 0.4) << places;
  }
}

TEST(PlaceIndex, APlacePassedTwiceIsNotNewEvenIfNoEdgeJoinsThePasses) {
  Chain chain(200);
  for (std::uint32_t i = 0; i < 200; ++i) {
    chain.graph.add_frame({1, 1000 + i});
    if (i > 0) chain.graph.add_edge({1, 1000 + i - 1}, {1, 1000 + i}, 0);
    (void)chain.index.add({1, 1000 + i}, chain.words_of[i]);
  }
  const PlaceAnswer answer = chain.index.query(chain.seen_again(100), chain.graph);
  ASSERT_GE(answer.candidates.size(), 2u);
  EXPECT_LT(answer.new_place, 0.1);
  EXPECT_NEAR(answer.candidates[0].probability, answer.candidates[1].probability, 1e-9);
}

TEST(PlaceIndex, AFrameWithoutWordsIsNotAdded) {
  Chain chain(50);
  chain.graph.add_frame({1, 50});
  ASSERT_TRUE(chain.index.add({1, 50}, {}).ok());
  EXPECT_FALSE(chain.index.contains({1, 50}));
  EXPECT_EQ(chain.index.size(), 50u);
  EXPECT_EQ(chain.index.left_out(), 0u);
}

// An index that is opened several times in one folder.
class KeptPlaceIndex : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kPlaces = 10000;  // two full blocks, and one that is not full

  std::unique_ptr<PlaceIndex> start(Status* restored, const storage::Graph& map,
                                    std::size_t allowance = std::numeric_limits<std::size_t>::max()) {
    auto index = std::make_unique<PlaceIndex>(chain_.vocabulary, PlaceIndexOptions{allowance, folder_ / ""});
    *restored = index->restore(map);
    return index;
  }
  std::unique_ptr<PlaceIndex> start(Status* restored) { return start(restored, chain_.graph); }
  void add_missing(PlaceIndex& index) {
    for (std::uint32_t i = 0; i < kPlaces; ++i) {
      ASSERT_TRUE(index.add({1, i}, chain_.words_of[i]).ok());
    }
  }
  void keep() {
    Status restored;
    const auto index = start(&restored);
    ASSERT_TRUE(restored.ok());
    add_missing(*index);
    ASSERT_TRUE(index->save().ok());
  }
  void expect_same_answers(const PlaceIndex& index) {
    ASSERT_EQ(index.size(), kPlaces);
    for (std::uint32_t i = 0; i < kPlaces; i += 997) {
      const auto query = chain_.seen_again(i);
      const storage::FrameRange later{1, i + 100, kPlaces};
      EXPECT_TRUE(same(index.query(query, chain_.graph), chain_.index.query(query, chain_.graph))) << i;
      EXPECT_TRUE(
          same(index.query(query, chain_.graph, {&later, 1}), chain_.index.query(query, chain_.graph, {&later, 1})))
          << i;
    }
  }
  void change(std::uint64_t at, char byte) {
    std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(at));
    file.put(byte);
  }
  std::string path() const { return folder_ / "places/blocks"; }

  const storage::TemporaryFolder folder_;
  Chain chain_{kPlaces};
};

TEST_F(KeptPlaceIndex, IsRestoredAsItWasSaved) {
  keep();
  Status restored;
  const auto index = start(&restored);
  EXPECT_TRUE(restored.ok()) << restored.to_string();
  EXPECT_TRUE(index->contains({1, kPlaces - 1}));
  expect_same_answers(*index);
}

TEST_F(KeptPlaceIndex, GoesOnGrowing) {
  for (const std::uint32_t until : {700u, 3000u, 9000u, kPlaces}) {
    Status restored;
    const auto index = start(&restored);
    EXPECT_TRUE(restored.ok()) << restored.to_string();
    for (std::uint32_t i = 0; i < until; ++i) ASSERT_TRUE(index->add({1, i}, chain_.words_of[i]).ok());
    EXPECT_EQ(index->size(), until);
    ASSERT_TRUE(index->save().ok());
  }
  Status restored;
  expect_same_answers(*start(&restored));
}

TEST_F(KeptPlaceIndex, FullBlocksSurviveACrash) {
  {
    Status restored;
    add_missing(*start(&restored));  // not saved
  }
  Status restored;
  const auto index = start(&restored);
  EXPECT_TRUE(restored.ok());
  EXPECT_EQ(index->size(), 2 * 4096u);
  add_missing(*index);
  expect_same_answers(*index);
}

TEST_F(KeptPlaceIndex, DamageIsReportedAndRepairedFromTheMap) {
  keep();
  const auto size = std::filesystem::file_size(path());
  struct Damage {
    std::uint64_t at;
    Reason reason;
  };
  // Damages the partial block, the first block, its length, the vocabulary's CRC, the version and the magic.
  for (const Damage& damage :
       {Damage{size - 100, Reason::DATA_LOSS}, Damage{5000, Reason::DATA_LOSS}, Damage{18, Reason::TRUNCATED},
        Damage{12, Reason::WRONG_VOCABULARY}, Damage{8, Reason::UNKNOWN_FORMAT_VERSION}, Damage{0, Reason::CORRUPT}}) {
    change(damage.at, '\x77');
    Status restored;
    const auto index = start(&restored);
    EXPECT_EQ(restored.reason(), damage.reason) << restored.to_string();
    EXPECT_LT(index->size(), kPlaces);
    add_missing(*index);
    expect_same_answers(*index);
    ASSERT_TRUE(index->save().ok());
  }
  Status restored;
  EXPECT_EQ(start(&restored)->size(), kPlaces);
  EXPECT_TRUE(restored.ok());
}

TEST_F(KeptPlaceIndex, ATruncatedFileIsRepaired) {
  keep();
  for (const double part : {0.999, 0.5, 1e-4, 0.0}) {
    const auto size = static_cast<double>(std::filesystem::file_size(path()));
    std::filesystem::resize_file(path(), static_cast<std::uint64_t>(part * size));
    Status restored;
    const auto index = start(&restored);
    add_missing(*index);
    expect_same_answers(*index);
    ASSERT_TRUE(index->save().ok());
  }
}

TEST_F(KeptPlaceIndex, FramesThatTheMapHasLostAreNotRestored) {
  keep();
  HandMadeGraph shorter;
  shorter.add_session(1, kStereoCamera);
  for (std::uint32_t i = 0; i < 6000; ++i) shorter.add_frame({1, i});
  Status restored;
  const auto index = start(&restored, shorter);
  EXPECT_EQ(restored.reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(index->size(), 4096u) << "the block with lost frames goes, and all behind it";
  add_missing(*index);
  expect_same_answers(*index);
}

TEST_F(KeptPlaceIndex, ASessionThatIsLeftOutIsNoLongerRecognised) {
  keep();
  HandMadeGraph going;
  going.add_session(1, kStereoCamera);
  for (std::uint32_t i = 0; i < 64; ++i) going.add_frame({1, i});
  going.edit_session(1).state = storage::SessionState::kDeleting;
  Status restored;
  const auto index = start(&restored, going);
  EXPECT_TRUE(restored.ok()) << "what has gone is no damage: " << restored.to_string();
  EXPECT_EQ(index->size(), kPlaces);
  const auto query = chain_.seen_again(500);
  ASSERT_FALSE(index->query(query, going).candidates.empty());
  index->leave_out(1);
  EXPECT_TRUE(index->query(query, going).candidates.empty());
  ASSERT_TRUE(index->add({2, 0}, chain_.words_of[500]).ok());
  const PlaceAnswer answer = index->query(query, going);
  ASSERT_FALSE(answer.candidates.empty());
  EXPECT_EQ(answer.candidates[0].frame, (FrameId{2, 0}));
}

TEST_F(KeptPlaceIndex, IsNotRestoredWithAnotherVocabulary) {
  keep();
  VocabularyModel other = independent_words(500);
  other.source = "another";
  PlaceIndex index(Vocabulary::from_bytes(encode_vocabulary(other)).or_throw(), {.folder = folder_ / ""});
  EXPECT_EQ(index.restore(chain_.graph).reason(), Reason::WRONG_VOCABULARY);
  EXPECT_EQ(index.size(), 0u);
}

TEST_F(KeptPlaceIndex, AnswersAreIdenticalWhereBlocksAreOnDisk) {
  const std::size_t empty = PlaceIndex(chain_.vocabulary).memory_bytes();
  const std::size_t whole = chain_.index.memory_bytes() - empty;
  // There is always room for a block being made and a block being read.
  const std::size_t allowance = empty + whole * 7 / 8;
  Status restored;
  const auto index = start(&restored, chain_.graph, allowance);
  for (std::uint32_t i = 0; i < kPlaces; ++i) {
    ASSERT_TRUE(index->add({1, i}, chain_.words_of[i]).ok()) << i;
    ASSERT_LE(index->memory_bytes(), allowance);
  }
  expect_same_answers(*index);
  ASSERT_TRUE(index->save().ok());
  const auto again = start(&restored, chain_.graph, allowance);
  EXPECT_TRUE(restored.ok());
  EXPECT_LE(again->memory_bytes(), allowance);
  expect_same_answers(*again);
}

TEST_F(KeptPlaceIndex, ABlockThatIsDamagedWhileInUseIsAnErrorAndNotAWrongAnswer) {
  const std::size_t empty = PlaceIndex(chain_.vocabulary).memory_bytes();
  Status restored;
  const auto index = start(&restored, chain_.graph, empty + (chain_.index.memory_bytes() - empty) * 7 / 8);
  add_missing(*index);
  change(5000, '\x77');
  try {
    (void)index->query(chain_.seen_again(50), chain_.graph);
    ADD_FAILURE() << "an answer";
  } catch (const StatusError& error) {
    EXPECT_EQ(error.status().reason(), Reason::DATA_LOSS);
  }
}

TEST_F(KeptPlaceIndex, ReportsAFailingDiskAndDoesNotGrow) {
  const std::size_t empty = PlaceIndex(chain_.vocabulary).memory_bytes();
  const std::size_t allowance = empty + (chain_.index.memory_bytes() - empty) * 7 / 8;
  PlaceIndex index(chain_.vocabulary, {allowance, folder_ / "not there"});
  EXPECT_EQ(index.restore(chain_.graph).reason(), Reason::IO_ERROR);
  std::size_t failed = 0, refused = 0;
  for (std::uint32_t i = 0; i < kPlaces; ++i) {
    const Status status = index.add({1, i}, chain_.words_of[i]);
    failed += status.reason() == Reason::IO_ERROR;
    refused += status.reason() == Reason::BUDGET_EXCEEDED;
    ASSERT_LE(index.memory_bytes(), allowance);
  }
  EXPECT_GE(failed, 2u) << "it tries again now and then";
  EXPECT_GT(refused, failed);
  EXPECT_EQ(index.left_out(), failed + refused);
  EXPECT_EQ(index.size() + index.left_out(), kPlaces);
  EXPECT_LE(apart(index.query(chain_.seen_again(20), chain_.graph).candidates.at(0).frame, 20), 2u);

  std::filesystem::create_directory(folder_ / "not there");
  for (std::uint32_t i = 0; i < kPlaces; ++i) (void)index.add({1, i}, chain_.words_of[i]);
  EXPECT_GT(index.size(), kPlaces - 300) << "it goes on once the disk can be written";
}

TEST(PlaceIndex, CountsItsMemory) {
  Chain chain(4200);
  const PlaceIndex empty(chain.vocabulary);
  const std::size_t grown = chain.index.memory_bytes() - empty.memory_bytes();
  EXPECT_GT(grown, 4200u * 40);
  EXPECT_LT(grown, 4200u * 400);
}

}  // namespace
}  // namespace relmap::place
