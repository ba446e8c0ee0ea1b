// The index with features: places with the same words are told apart by their descriptors, and the answer depends on
// the places alone.
#include "server/place/compare_places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "server/place/testing/hand_made_graph.h"
#include "server/place/testing/random_vocabulary.h"

namespace relmap::place {
namespace {

class ComparePlaces : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kPlaces = 60, kFar = 20;  // kFar frames apart, so that no place is another's neighbour

  ComparePlaces() {
    graph_.add_session(1, kMonoCamera);
    for (std::uint32_t i = 0; i < kPlaces; ++i) pictures_.push_back(picture(i));
  }
  // All places show nearly the same words but with different descriptors.
  storage::FrameCold picture(std::uint32_t number) {
    std::mt19937_64 random(number + 1);
    storage::FrameCold cold;
    for (std::uint32_t word = 0; word < 100; ++word) {
      if (random() % 10 == 0) continue;
      auto& feature = cold.appearance.emplace_back();
      for (std::uint8_t& byte : feature.descriptor) byte = static_cast<std::uint8_t>(random() % 90);
      cold.words.push_back(word);
    }
    return cold;
  }
  static FrameId frame(std::uint32_t place) { return {1, place * kFar}; }
  void add(PlaceIndex& index, std::uint32_t place, bool with_features = true) {
    storage::FrameCold cold = pictures_[place];
    if (!with_features) cold = {};
    graph_.add_frame(frame(place), {}, {}, std::move(cold));
    ASSERT_TRUE(index.add(frame(place), pictures_[place].words).ok());
  }
  // The picture of a place with every second feature changed.
  storage::FrameCold seen_again(std::uint32_t place) {
    storage::FrameCold cold = pictures_[place];
    for (std::size_t i = 0; i < cold.words.size(); i += 2)
      std::reverse(cold.appearance[i].descriptor.begin(), cold.appearance[i].descriptor.end());
    return cold;
  }
  PlaceAnswer ask(const PlaceIndex& index, const storage::FrameCold& picture, std::optional<FrameId> near = {}) {
    return index.query(picture.words, graph_, {}, near, picture.appearance);
  }

  const std::shared_ptr<const Vocabulary> vocabulary_ = random_vocabulary(200, 50, 1);
  HandMadeGraph graph_;
  std::vector<storage::FrameCold> pictures_;
};

TEST_F(ComparePlaces, PlacesOfTheSameWordsAreToldApart) {
  PlaceIndex index(vocabulary_);
  for (std::uint32_t i = 0; i < 30; ++i) add(index, i);
  for (const std::uint32_t place : {0u, 17u, 29u}) {
    const PlaceAnswer answer = ask(index, seen_again(place));
    ASSERT_FALSE(answer.candidates.empty());
    EXPECT_EQ(answer.candidates[0].frame, frame(place));
    EXPECT_GT(answer.candidates[0].probability, 0.9);
    double sum = answer.new_place;
    for (const PlaceCandidate& candidate : answer.candidates) sum += candidate.probability;
    EXPECT_LE(sum, 1 + 1e-12);
    // The answer by words alone.
    EXPECT_LT(index.query(seen_again(place).words, graph_).candidates.at(0).probability, 0.9);
  }
  EXPECT_GT(ask(index, picture(1000)).new_place, 0.5) << "the same words, and nothing like any of them";
}

TEST_F(ComparePlaces, WordsAloneDecideAmongFewPlaces) {
  PlaceIndex index(vocabulary_);
  for (std::uint32_t i = 0; i + 1 < kMinGroups; ++i) add(index, i);
  const storage::FrameCold query = seen_again(1);
  const PlaceAnswer answer = ask(index, query), by_words = index.query(query.words, graph_);
  EXPECT_EQ(answer.new_place, by_words.new_place);
}

TEST_F(ComparePlaces, AnswersDoNotDependOnTheOrderOfPlaces) {
  std::vector<std::uint32_t> order(kPlaces);
  std::iota(order.begin(), order.end(), 0u);
  const auto answer_in_order = [&] {
    PlaceIndex index(vocabulary_);
    for (const std::uint32_t place : order) add(index, place);
    return ask(index, seen_again(23), frame(40));
  };
  const PlaceAnswer first = answer_in_order();
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  const PlaceAnswer second = answer_in_order();
  EXPECT_EQ(first.new_place, second.new_place);
  ASSERT_EQ(first.candidates.size(), second.candidates.size());
  for (std::size_t i = 0; i < first.candidates.size(); ++i) {
    EXPECT_EQ(first.candidates[i].frame, second.candidates[i].frame);
    EXPECT_EQ(first.candidates[i].probability, second.candidates[i].probability);
  }
  EXPECT_EQ(first.candidates.at(0).frame, frame(23));
}

TEST_F(ComparePlaces, WhereTheQueryIsThoughtToBeIsLikelierAndAlwaysCompared) {
  pictures_[40] = pictures_[23];  // they look the same
  PlaceIndex index(vocabulary_);
  for (std::uint32_t i = 0; i < kPlaces; ++i) add(index, i);
  const auto probability = [&](const PlaceAnswer& answer, std::uint32_t place) {
    for (const PlaceCandidate& candidate : answer.candidates)
      if (candidate.frame == frame(place)) return candidate.probability;
    return 0.0;
  };
  const PlaceAnswer anywhere = ask(index, seen_again(23)), here = ask(index, seen_again(23), frame(40));
  EXPECT_NEAR(probability(anywhere, 23), probability(anywhere, 40), 1e-9);
  EXPECT_GT(probability(here, 40), 0.9);
}

TEST_F(ComparePlaces, APlaceWhoseFeaturesAreLostIsUnlike) {
  PlaceIndex index(vocabulary_);
  for (std::uint32_t i = 0; i < 30; ++i) add(index, i, i != 7);
  const PlaceAnswer answer = ask(index, seen_again(7));
  EXPECT_GT(answer.new_place, 0.5);
  EXPECT_EQ(ask(index, seen_again(8)).candidates.at(0).frame, frame(8));
}

}  // namespace
}  // namespace relmap::place
