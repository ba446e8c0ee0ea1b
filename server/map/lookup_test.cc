#include "server/map/lookup.h"

#include <gtest/gtest.h>

#include "server/place/hand_made_graph.h"
#include "server/place/random_vocabulary.h"
#include "server/place/synthetic_street.h"

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

TEST(FirstRecent, IsAThousandFramesBackAtMost) {
  EXPECT_EQ(first_recent(session_of(kStereo, 1300, 1), {1, 1250}), 250u);
  EXPECT_EQ(first_recent(session_of(kMono, 1300, 1), {1, 1250}), 250u);
}

TEST(FirstRecent, EndsWhereAMonoSessionIsBroken) {
  HandMadeGraph graph;
  graph.add_session(1, kMono);
  for (std::uint32_t i = 0; i < 40; ++i)
    if (i != 20 && (i < 30 || i > 33)) graph.add_frame({1, i});
  EXPECT_EQ(first_recent(graph, {1, 36}), 34u) << "four are missing";
  EXPECT_EQ(first_recent(graph, {1, 29}), 0u) << "one is missing, and all are of one time";
}

// The same picture, taken by a robot of two eyes and by one of one.
TEST(LookUp, AMonoFrameProposesNothing) {
  constexpr std::uint32_t kFrames = 20, kSeenAgain = 10;
  const auto vocabulary = random_vocabulary(200, 50, 1);
  SyntheticStreet street(3, kFrames, 0.3);
  PlaceIndex places(vocabulary);
  for (std::uint32_t i = 0; i < kFrames; ++i)
    ASSERT_TRUE(places.add({1, i}, vocabulary->words(street.graph.cold({1, i})->appearance)).ok());
  const auto proposals = [&](const StereoCamera& camera) {
    street.graph.add_session(2, camera);
    FrameCold cold;
    std::vector<std::size_t> points;
    cold.appearance = street.picture(street.pose(kSeenAgain), camera.is_stereo(), points);
    cold.words = vocabulary->words(cold.appearance);
    street.graph.add_frame({2, 0}, {}, {}, std::move(cold));
    return look_up(street.graph, places, {2, 0});
  };
  const auto stereo = proposals(kStreetCamera);
  ASSERT_EQ(stereo.size(), 1u);
  EXPECT_EQ(std::get<ClosureProposalRecord>(stereo.front()).query, (FrameId{2, 0}));
  StereoCamera one_eye = kStreetCamera;
  one_eye.baseline = 0;
  EXPECT_TRUE(proposals(one_eye).empty());
}

}  // namespace
}  // namespace relmap
