#include "server/place/place_block.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/place/testing/random_vocabulary.h"

namespace relmap::place {
namespace {

class PlaceBlockTest : public ::testing::Test {
 protected:
  // Frames of two sessions alternate; word 599 is at one place in 700.
  std::vector<PlaceWords> places(std::uint32_t count) {
    std::vector<PlaceWords> result;
    for (std::uint32_t i = 0; i < count; ++i) {
      PlaceWords place{{1 + i % 2, i / 2 + (i > 100 ? 7 : 0)}, {}};
      for (std::uint32_t w = 0; w < 599; ++w)
        if (random_() % (2 + w / 8) == 0) place.words.push_back(w);
      if (i % 700 == 0) place.words.push_back(599);
      result.push_back(std::move(place));
    }
    return result;
  }
  Bytes encode(std::span<const PlaceWords> of, const PlaceBlock* older = nullptr) const {
    return encode_place_block(model_, older, of);
  }

  std::shared_ptr<const Vocabulary> vocabulary_ = random_vocabulary(600, 1, 1);
  FabMapModel model_{*vocabulary_};
  std::mt19937_64 random_{1};
};

TEST_F(PlaceBlockTest, HoldsWhatWasPutIn) {
  auto all = places(kPlacesPerBlock);
  const Bytes bytes = encode(all);
  const PlaceBlock block = PlaceBlock::parse(bytes, 600).or_throw();
  std::sort(all.begin(), all.end(), [](const auto& x, const auto& y) { return x.frame < y.frame; });
  ASSERT_EQ(block.places(), all.size());
  std::vector<std::vector<std::uint32_t>> words(all.size());
  std::size_t bitmaps = 0;
  for (std::uint32_t w = 0; w < 600; ++w) {
    bitmaps += block.list(w).bitmap;
    for_each_slot(block.list(w), [&](std::uint32_t slot) { words[slot].push_back(w); });
  }
  EXPECT_GT(bitmaps, 50u);
  EXPECT_LT(bitmaps, 550u);
  std::uint32_t slot = 0;
  for (const FrameRun& run : block.frames())
    for (std::uint32_t i = 0; i < run.count; ++i, ++slot) {
      EXPECT_EQ(all[slot].frame, (FrameId{run.first.session, run.first.index + i}));
      EXPECT_EQ(words[slot], all[slot].words);
    }
  EXPECT_EQ(slot, all.size());
  EXPECT_EQ(block.frames().size(), 4u) << "of two sessions, each with one gap";
}

TEST_F(PlaceBlockTest, HasTheSameBytesHoweverItGrew) {
  auto all = places(2000);
  const Bytes at_once = encode(all);
  std::shuffle(all.begin(), all.end(), random_);
  Bytes grown = encode(std::span(all).first(100));
  for (std::size_t at = 100; at < all.size(); at += 380) {
    const Bytes before = grown;
    const PlaceBlock older = PlaceBlock::parse(before, 600).or_throw();
    grown = encode(std::span(all).subspan(at, 380), &older);
  }
  EXPECT_EQ(grown, at_once);
}

TEST_F(PlaceBlockTest, DamagedBytesAreRefusedOrHarmless) {
  const Bytes good = encode(places(150));
  std::vector<LogLikelihood> unused;
  for (std::size_t i = 0; i < good.size(); i += 1 + i / 64) {
    Bytes bad = good;
    bad[i] = static_cast<std::uint8_t>(random_());
    const auto block = PlaceBlock::parse(bad, 600);
    if (!block.ok()) continue;
    std::uint32_t highest = 0;
    for (std::uint32_t w = 0; w < 600; ++w)
      for_each_slot(block->list(w), [&](std::uint32_t slot) { highest = std::max(highest, slot); });
    EXPECT_LT(highest, block->places()) << "byte " << i;
  }
  for (std::size_t size = 0; size < good.size(); size += 1 + size / 16)
    EXPECT_EQ(PlaceBlock::parse(ByteSpan(good).first(size), 600).reason(), Reason::CORRUPT) << size << " bytes";
}

TEST_F(PlaceBlockTest, ABlockOfAnotherVocabularyIsRefused) {
  const Bytes bytes = encode(places(10));
  EXPECT_EQ(PlaceBlock::parse(bytes, 601).reason(), Reason::CORRUPT);
}

}  // namespace
}  // namespace relmap::place
