#include "tools/relmap/frame_sample.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relmap::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::size_t kMost = 120;

client::Session session_of(SessionNumber number, std::uint32_t first, std::uint32_t frames) {
  client::Session session;
  session.number = number;
  session.frames = frames;
  session.first = first;
  session.last = frames > 0 ? first + frames - 1 : first;
  return session;
}

TEST(FrameSample, TakesEachFrameOfASmallSessionOnce) {
  const auto sample =
      sample_frames({session_of(1, 0, 1), session_of(2, 5, 2), session_of(3, 0, 0), session_of(4, 0, 100'000)}, kMost);
  ASSERT_EQ(sample.size(), 3u) << "one has no frame";
  EXPECT_EQ(sample[0].session, 1u);
  EXPECT_THAT(sample[0].indices, ElementsAre(0));
  EXPECT_THAT(sample[1].indices, ElementsAre(5, 6));
  EXPECT_EQ(sample[2].session, 4u);
  EXPECT_EQ(sample[2].indices.size(), 119u);
  EXPECT_EQ(sample[2].indices.front(), 0u);
  EXPECT_EQ(sample[2].indices.back(), 99'999u);
  std::vector<client::Session> many;
  for (SessionNumber number = 1; number <= 50; ++number) many.push_back(session_of(number, 7, 1 + number % 2));
  std::size_t frames = 0;
  for (const SampledSession& session : sample_frames(many, kMost)) frames += session.indices.size();
  EXPECT_EQ(frames, 75u) << "all that there are";
}

TEST(FrameSample, SpreadsTheChoiceOverFramesAndSessions) {
  EXPECT_THAT(sample_frames({session_of(1, 10, 101)}, 5).at(0).indices, ElementsAre(10, 35, 60, 85, 110));
  std::vector<client::Session> many;
  for (SessionNumber number = 1; number <= 1000; ++number) many.push_back(session_of(number, 0, 40));
  const auto sample = sample_frames(many, kMost);
  ASSERT_EQ(sample.size(), kMost);
  EXPECT_EQ(sample.front().session, 1u);
  EXPECT_EQ(sample.back().session, 1000u);
  for (std::size_t i = 0; i < sample.size(); ++i) {
    EXPECT_THAT(sample[i].indices, ElementsAre(0, 19, 39));
    if (i == 0) continue;
    EXPECT_GE(sample[i].session - sample[i - 1].session, 8u);
    EXPECT_LE(sample[i].session - sample[i - 1].session, 9u);
  }
}

TEST(FrameSample, OfAnEmptyMapThereIsNone) {
  EXPECT_THAT(sample_frames({}, kMost), IsEmpty());
  EXPECT_THAT(sample_frames({session_of(1, 0, 0)}, kMost), IsEmpty());
}

}  // namespace
}  // namespace relmap::cli
