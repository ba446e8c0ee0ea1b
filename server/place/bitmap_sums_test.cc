#include "server/place/bitmap_sums.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace relmap::place {
namespace {

TEST(BitmapSums, EqualTheSumsAddedWordByWord) {
  std::mt19937_64 random(1);
  for (const std::size_t places : {128u, 256u, 4096u}) {
    const std::size_t bytes = places / 8;
    std::vector<std::vector<std::uint8_t>> bitmaps(kBitmapWords, std::vector<std::uint8_t>(bytes));
    BitmapWords words;
    std::vector<LogLikelihood> expected(places);
    for (LogLikelihood& score : expected) score = static_cast<LogLikelihood>(random() >> 3);
    std::vector<LogLikelihood> scores = expected, portable = expected;
    for (std::size_t w = 0; w < kBitmapWords; ++w) {
      words.bitmaps[w] = bitmaps[w].data();
      words.increments[w] = static_cast<LogLikelihood>(random() >> 8) - (LogLikelihood{1} << 55);
      for (std::size_t i = 0; i < places; ++i)
        if (random() % (w + 1) == 0) {
          bitmaps[w][i / 8] |= static_cast<std::uint8_t>(1u << i % 8);
          expected[i] += words.increments[w];
        }
    }
    add_bitmaps(words, bytes, scores.data());
    add_bitmaps_portably(words, bytes, portable.data());
    EXPECT_EQ(scores, expected);
    EXPECT_EQ(portable, expected);
  }
}

}  // namespace
}  // namespace relmap::place
