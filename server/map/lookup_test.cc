#include "server/map/lookup.h"

#include <gtest/gtest.h>

#include "server/place/hand_made_graph.h"
#include "server/place/random_vocabulary.h"

namespace relmap {
namespace {

constexpr StereoCamera kStereo{400, 256, 192, 0.12, 512, 384}, kMono{400, 256, 192, 0, 512, 384};

// Frames 0 .. count - 1 of session 1, a second apart.
HandMadeGraph session_of(const StereoCamera& camera, std::uint32_t count, std::int64_t apart_us = 1'000'000) {
  HandMadeGraph graph;
  graph.add_session(1, camera);
  for (std::uint32_t i = 0; i < count; ++i) {
    FrameHot hot;
    hot.time_us = std::int64_t{i} * apart_us;
    graph.add_frame({1, i}, std::move(hot));
    if (i > 0 && camera.is_stereo()) graph.add_edge({1, i - 1}, {1, i}, 0);
  }
  return graph;
}

TEST(FirstRecent, IsTwentyFramesBackInAMonoSessionToo) {
  EXPECT_EQ(first_recent(session_of(kStereo, 100), {1, 70}), 50u);
  EXPECT_EQ(first_recent(session_of(kMono, 100), {1, 70}), 50u);
  EXPECT_EQ(first_recent(session_of(kMono, 100), {1, 7}), 0u);
}

TEST(FirstRecent, IsTenSecondsBackWherePicturesComeFast) {
  EXPECT_EQ(first_recent(session_of(kStereo, 100, 200'000), {1, 70}), 20u);
  EXPECT_EQ(first_recent(session_of(kMono, 100, 200'000), {1, 70}), 20u);
}

TEST(FirstRecent, EndsWhereAMonoSessionIsBroken) {
  HandMadeGraph graph;
  graph.add_session(1, kMono);
  for (std::uint32_t i = 0; i < 40; ++i)
    if (i != 20 && (i < 30 || i > 33)) graph.add_frame({1, i});
  EXPECT_EQ(first_recent(graph, {1, 36}), 34u) << "four are missing";
  EXPECT_EQ(first_recent(graph, {1, 29}), 0u) << "one is missing, and all are of one time";
}

TEST(LookUp, AMonoFrameProposesNothing) {
  const auto vocabulary = random_vocabulary(200, 50, 1);
  std::vector<std::uint32_t> words;
  for (std::uint32_t w = 0; w < 40; ++w) words.push_back(5 * w);
  PlaceIndex places(vocabulary);
  HandMadeGraph graph;
  graph.add_session(1, kStereo);
  graph.add_session(2, kMono);
  graph.add_frame({1, 0});
  ASSERT_TRUE(places.add({1, 0}, words).ok());
  FrameCold cold;
  cold.words = words;
  graph.add_frame({2, 0}, {}, {}, std::move(cold));
  ASSERT_FALSE(places.query(words, graph).candidates.empty());
  EXPECT_TRUE(look_up(graph, places, {2, 0}).empty());
}

}  // namespace
}  // namespace relmap
