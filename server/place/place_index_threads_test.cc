// One thread adds to a place index while others ask it, more of them than the index answers at a time.
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>

#include "server/place/place_index.h"
#include "server/place/testing/hand_made_graph.h"
#include "server/place/testing/random_vocabulary.h"

namespace relmap::place {
namespace {

TEST(PlaceIndexThreads, ReadersAndTheWriterMayWorkAtOnce) {
  constexpr std::uint32_t kBefore = 100, kAll = 300, kAsked = 50;
  const auto vocabulary = Vocabulary::from_bytes(encode_vocabulary(random_vocabulary_model(500, 200, 1))).or_throw();
  HandMadeGraph graph;
  graph.add_session(1, kStereoCamera);
  std::mt19937_64 random(2);
  std::vector<std::vector<std::uint32_t>> words_of(kAll);
  for (std::uint32_t i = 0; i < kAll; ++i) {
    graph.add_frame({1, i});
    if (i > 0) graph.add_edge({1, i - 1}, {1, i}, 0);
    for (std::uint32_t word = 0; word < vocabulary->size(); ++word)
      if (std::bernoulli_distribution(vocabulary->marginal()[word])(random)) words_of[i].push_back(word);
  }
  PlaceIndex index(vocabulary, {.folder = {}, .queries = 3});
  for (std::uint32_t i = 0; i < kBefore; ++i) (void)index.add({1, i}, words_of[i]);
  std::atomic<bool> stop{false};
  std::atomic<int> asked{0}, wrong{0};
  std::vector<std::thread> readers;
  for (int r = 0; r < 4; ++r)
    readers.emplace_back([&] {
      while (!stop) {
        const PlaceAnswer answer = index.query(words_of[kAsked], graph);
        ++asked;
        if (answer.candidates.empty() || answer.candidates[0].frame != FrameId{1, kAsked}) ++wrong;
        if (index.memory_bytes() == 0) ++wrong;
      }
    });
  for (std::uint32_t i = kBefore; i < kAll; ++i) {
    (void)index.add({1, i}, words_of[i]);
    if (i % 10 == 0)  // so that all sizes are asked, however the threads are scheduled
      for (const int before = asked; asked < before + 2;) std::this_thread::yield();
  }
  stop = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(wrong, 0) << "of " << asked;
  EXPECT_EQ(index.size(), kAll);
}

}  // namespace
}  // namespace relmap::place
