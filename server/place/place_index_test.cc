#include "server/place/place_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <random>
#include <thread>

#include "server/place/hand_made_graph.h"
#include "server/place/random_vocabulary.h"
#include "storage/testing/temporary_folder.h"

namespace relmap {
namespace {

constexpr StereoCamera kStereo{400, 256, 192, 0.12, 512, 384};
constexpr StereoCamera kMono{400, 256, 192, 0, 512, 384};

// Words that do not depend on each other, so that pictures are easily drawn.
VocabularyModel independent_words(std::uint32_t words) {
  VocabularyModel model = random_vocabulary_model(words, 200, 1);
  model.given_parent_absent = model.given_parent_present = model.marginal;
  return model;
}

// Places along a chain, drawn from the vocabulary's own marginals; a tenth of the words changes from one to the next.
class Chain {
 public:
  explicit Chain(std::uint32_t frames, const StereoCamera& camera = kStereo)
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
  // What a camera sees that comes back to frame i: half of the same, half something else.
  std::vector<std::uint32_t> seen_again(std::uint32_t i) { return changed(words_of[i], 0.5); }

  std::shared_ptr<const Vocabulary> vocabulary;
  PlaceIndex index;
  HandMadeGraph graph;
  std::vector<std::vector<std::uint32_t>> words_of;

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  // Every word of the vocabulary is drawn anew with probability `share`.
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

TEST(PlaceIndex, AnEmptyMapHoldsNoPlace) {
  Chain chain(0);
  const PlaceAnswer answer = chain.index.query(chain.draw(), chain.graph);
  EXPECT_TRUE(answer.candidates.empty());
  EXPECT_EQ(answer.new_place, 1);
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

TEST(PlaceIndex, MassIsSummedOverGraphNeighbours) {
  // The same words at every frame: each is as likely as the next, and only together are they one place.
  const auto vocabulary = random_vocabulary(500, 50, 1);
  PlaceIndex index(vocabulary);
  HandMadeGraph graph;
  graph.add_session(1, kStereo);
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
  Chain chain(50, kMono);
  const PlaceAnswer answer = chain.index.query(chain.words_of[25], chain.graph);
  ASSERT_EQ(answer.candidates.size(), 1u);
  EXPECT_GT(answer.candidates[0].probability, 0.9);
}

TEST(PlaceIndex, MaskedFramesAreLeftOutOfTheSum) {
  Chain chain(120);
  const auto query = chain.seen_again(115);
  const PlaceAnswer answer = chain.index.query(query, chain.graph, [](FrameId frame) { return frame.index >= 80; });
  for (const PlaceCandidate& candidate : answer.candidates) EXPECT_LT(candidate.frame.index, 80u);
  EXPECT_GT(answer.new_place, 0.9);
  EXPECT_EQ(chain.index.query(query, chain.graph, [](FrameId) { return true; }).new_place, 1);
}

TEST(PlaceIndex, AFrameIsAPlaceOnce) {
  Chain chain(10);
  (void)chain.index.add({1, 3}, chain.words_of[3]);
  EXPECT_EQ(chain.index.size(), 10u);
}

TEST(PlaceIndex, AnswersDoNotDependOnTheOrderOfAdding) {
  Chain chain(2500);
  PlaceIndex reversed(chain.vocabulary);
  for (std::uint32_t i = 2500; i-- > 0;) (void)reversed.add({1, i}, chain.words_of[i]);
  for (const std::uint32_t i : {5u, 1200u, 2400u}) {
    const auto query = chain.seen_again(i);
    const PlaceAnswer a = chain.index.query(query, chain.graph), b = reversed.query(query, chain.graph);
    EXPECT_NEAR(a.new_place, b.new_place, 1e-9);
    ASSERT_EQ(a.candidates.size(), b.candidates.size());
    for (std::size_t k = 0; k < a.candidates.size(); ++k) {
      EXPECT_EQ(a.candidates[k].frame, b.candidates[k].frame);
      EXPECT_NEAR(a.candidates[k].probability, b.candidates[k].probability, 1e-9);
    }
  }
}

TEST(PlaceIndex, FarPlacesOfALargeMapStandForTheUnknownWorld) {
  // Words that no shipped place holds but that this map shows everywhere: only its own samples know them as common.
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
  PlaceIndex small(vocabulary), large(vocabulary);
  HandMadeGraph graph;
  graph.add_session(1, kStereo);
  for (std::uint32_t i = 0; i < 2100; ++i) {
    graph.add_frame({1, i});
    const auto words = picture();
    if (i < 1900) (void)small.add({1, i}, words);
    (void)large.add({1, i}, words);
  }
  double new_small = 0, new_large = 0;
  for (int i = 0; i < 10; ++i) {
    const auto elsewhere = picture();
    new_small += small.query(elsewhere, graph).new_place / 10;
    new_large += large.query(elsewhere, graph).new_place / 10;
  }
  EXPECT_LT(new_small, 0.1);
  EXPECT_GT(new_large, 0.4);
}

TEST(PlaceIndex, ReadersAndTheWriterMayWorkAtOnce) {
  Chain chain(300);
  PlaceIndex index(chain.vocabulary);
  for (std::uint32_t i = 0; i < 100; ++i) (void)index.add({1, i}, chain.words_of[i]);
  const auto query = chain.seen_again(50);
  std::atomic<bool> stop{false};
  std::atomic<int> wrong{0};
  std::vector<std::thread> readers;
  for (int r = 0; r < 2; ++r)
    readers.emplace_back([&] {
      while (!stop) {
        const PlaceAnswer answer = index.query(query, chain.graph);
        if (answer.candidates.empty() || apart(answer.candidates[0].frame, 50) > 2) ++wrong;
        if (index.memory_bytes() == 0) ++wrong;
      }
    });
  for (std::uint32_t i = 100; i < 300; ++i) (void)index.add({1, i}, chain.words_of[i]);
  stop = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(index.size(), 300u);
}

bool same(const PlaceAnswer& a, const PlaceAnswer& b) {
  return a.new_place == b.new_place &&
         std::equal(a.candidates.begin(), a.candidates.end(), b.candidates.begin(), b.candidates.end(),
                    [](const PlaceCandidate& x, const PlaceCandidate& y) {
                      return x.frame == y.frame && x.probability == y.probability;
                    });
}

TEST(PlaceIndex, AnswersTheSameBitForBitWhereTheListsAreOnDisk) {
  const TemporaryFolder folder;
  Chain chain(3000);
  const std::size_t empty = PlaceIndex(chain.vocabulary).memory_bytes();
  const std::size_t allowance = empty + 3000 * 60 + 100'000;
  PlaceIndex paged(chain.vocabulary, {allowance, folder / ""});
  for (std::uint32_t i = 0; i < 3000; ++i) {
    ASSERT_TRUE(paged.add({1, i}, chain.words_of[i]).ok());
    ASSERT_LE(paged.memory_bytes(), allowance);
    if (i % 250 == 0) {
      const auto query = chain.seen_again(i / 2);
      EXPECT_EQ(paged.query(query, chain.graph).candidates.at(0).frame.session, 1u);
    }
  }
  EXPECT_GT(chain.index.memory_bytes() - empty, 3 * (allowance - empty)) << "no test of paging";
  for (std::uint32_t i = 0; i < 3000; i += 50) {
    const auto query = chain.seen_again(i);
    const auto recent = [&](FrameId frame) { return frame.index > i + 100; };
    EXPECT_TRUE(same(paged.query(query, chain.graph), chain.index.query(query, chain.graph))) << i;
    EXPECT_TRUE(same(paged.query(query, chain.graph, recent), chain.index.query(query, chain.graph, recent))) << i;
  }
}

TEST(PlaceIndex, WhereTheDiskTakesNothingItSaysSoAndDoesNotGrow) {
  Chain chain(1500);
  const std::size_t empty = PlaceIndex(chain.vocabulary).memory_bytes();
  const std::size_t allowance = empty + 200'000;
  const TemporaryFolder folder;
  PlaceIndex index(chain.vocabulary, {allowance, folder / "not there"});
  std::size_t failed = 0, refused = 0;
  for (std::uint32_t i = 0; i < 1500; ++i) {
    const Status status = index.add({1, i}, chain.words_of[i]);
    failed += status.reason() == Reason::IO_ERROR;
    refused += status.reason() == Reason::BUDGET_EXCEEDED;
    ASSERT_LE(index.memory_bytes(), allowance);
  }
  EXPECT_GE(failed, 2u) << "it tries again now and then";
  EXPECT_GT(refused, failed);
  EXPECT_EQ(index.left_out(), failed + refused);
  EXPECT_EQ(index.size() + index.left_out(), 1500u);
  EXPECT_LE(apart(index.query(chain.seen_again(20), chain.graph).candidates.at(0).frame, 20), 2u);

  std::filesystem::create_directory(folder / "not there");
  for (std::uint32_t i = 0; i < 1500; ++i) (void)index.add({1, i}, chain.words_of[i]);
  EXPECT_GT(index.size(), 1200u) << "and goes on when there is room again";
}

TEST(PlaceIndex, CountsItsMemory) {
  Chain chain(1000);
  const PlaceIndex empty(chain.vocabulary);
  const std::size_t grown = chain.index.memory_bytes() - empty.memory_bytes();
  EXPECT_GT(grown, 1000u * 70 * 4);
  EXPECT_LT(grown, 1000u * (90 * 4 * 5 / 4 + 100));
}

}  // namespace
}  // namespace relmap
