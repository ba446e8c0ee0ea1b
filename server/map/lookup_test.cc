#include "server/map/lookup.h"

#include <gtest/gtest.h>

#include "server/place/testing/hand_made_graph.h"
#include "server/place/testing/random_vocabulary.h"
#include "server/place/testing/synthetic_street.h"

namespace relmap::map {
namespace {

// Frames 0 .. count - 1 of session 1, a second apart.
place::HandMadeGraph session_of(const StereoCamera& camera, std::uint32_t count, std::int64_t apart_us = 1'000'000) {
  place::HandMadeGraph graph;
  graph.add_session(1, camera);
  for (std::uint32_t i = 0; i < count; ++i) {
    storage::FrameHot hot;
    hot.time_us = std::int64_t{i} * apart_us;
    graph.add_frame({1, i}, std::move(hot));
    if (i > 0 && camera.is_stereo()) graph.add_edge({1, i - 1}, {1, i}, 0);
  }
  return graph;
}

TEST(FirstRecent, IsTwentyFramesBackInAMonoSessionToo) {
  EXPECT_EQ(first_recent(session_of(place::kStereoCamera, 100), {1, 70}), 50u);
  EXPECT_EQ(first_recent(session_of(place::kMonoCamera, 100), {1, 70}), 50u);
  EXPECT_EQ(first_recent(session_of(place::kMonoCamera, 100), {1, 7}), 0u);
}

TEST(FirstRecent, IsTenSecondsBackWherePicturesComeFast) {
  EXPECT_EQ(first_recent(session_of(place::kStereoCamera, 100, 200'000), {1, 70}), 20u);
  EXPECT_EQ(first_recent(session_of(place::kMonoCamera, 100, 200'000), {1, 70}), 20u);
}

TEST(FirstRecent, IsAThousandFramesBackAtMost) {
  EXPECT_EQ(first_recent(session_of(place::kStereoCamera, 1300, 1), {1, 1250}), 250u);
  EXPECT_EQ(first_recent(session_of(place::kMonoCamera, 1300, 1), {1, 1250}), 250u);
}

// In a lift a robot sees the cabin before and after it was carried.
TEST(FirstRecent, DoesNotCountWhereTheRobotStoodStill) {
  place::HandMadeGraph graph;
  graph.add_session(1, place::kStereoCamera);
  for (std::uint32_t i = 0; i < 200; ++i) {
    storage::FrameHot hot;
    hot.time_us = std::int64_t{i} * 1'000'000;
    graph.add_frame({1, i}, std::move(hot));
    if (i == 0) continue;
    graph.add_edge({1, i - 1}, {1, i}, 0);
    storage::Edge& step = graph.edit_hot({1, i}).edges.front();
    const bool stood = i > 100 && i <= 130;
    (stood ? step.standing_s : step.driven_s) = 1;
  }
  EXPECT_EQ(first_recent(graph, {1, 100}), 80u);
  EXPECT_EQ(first_recent(graph, {1, 130}), 80u);
  EXPECT_EQ(first_recent(graph, {1, 140}), 90u);
  EXPECT_EQ(first_recent(graph, {1, 150}), 100u);
  EXPECT_EQ(first_recent(graph, {1, 151}), 131u);
}

TEST(FirstRecent, EndsWhereAMonoSessionIsBroken) {
  place::HandMadeGraph graph;
  graph.add_session(1, place::kMonoCamera);
  for (std::uint32_t i = 0; i < 40; ++i)
    if (i != 20 && (i < 30 || i > 33)) graph.add_frame({1, i});
  EXPECT_EQ(first_recent(graph, {1, 36}), 34u) << "four are missing";
  EXPECT_EQ(first_recent(graph, {1, 29}), 0u) << "one is missing, and all are of one time";
}

TEST(RecentPast, IsAllOfTheSessionFromTheFirstRecentFrameOn) {
  const place::HandMadeGraph graph = session_of(place::kStereoCamera, 100);
  const storage::FrameRange past = recent_past(graph, {1, 70});
  EXPECT_FALSE(past.contains({1, 49}));
  for (const std::uint32_t i : {50u, 70u, 99u, 1000u}) EXPECT_TRUE(past.contains({1, i})) << i;
  EXPECT_FALSE(past.contains({2, 70})) << "of another session";
}

// Session 1 has driven a street; robots with other cameras stand where one of its frames was taken.
class LookUpAs : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 20, kSeenAgain = 10;

  LookUpAs() {
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      storage::FrameCold& cold = street_.graph.edit_cold({1, i});
      cold.words = vocabulary_->words(cold.appearance);
      EXPECT_TRUE(places_.add({1, i}, cold.words).ok());
    }
  }
  // What a robot sees that is said to have this camera, as frame 0 of the next session.
  Lookup look_up_as(const StereoCamera& camera, const LaterFrames& later = {}) {
    street_.graph.add_session(++session_, camera);
    storage::FrameCold cold;
    std::vector<std::size_t> points;
    cold.appearance = street_.picture(street_.pose(kSeenAgain), camera.is_stereo(), points);
    cold.words = vocabulary_->words(cold.appearance);
    street_.graph.add_frame({session_, 0}, {}, {}, std::move(cold));
    place::PictureCache pictures;
    return look_up(street_.graph, places_, pictures, {session_, 0}, later);
  }

  std::shared_ptr<const place::Vocabulary> vocabulary_ = place::random_vocabulary(200, 50, 1);
  place::SyntheticStreet street_{3, kFrames, 0.3};
  place::PlaceIndex places_{vocabulary_};
  SessionNumber session_ = 1;
};

TEST_F(LookUpAs, AMonoFrameProposesNothing) {
  const auto stereo = look_up_as(place::kStreetCamera).records;
  ASSERT_EQ(stereo.size(), 1u);
  EXPECT_EQ(std::get<storage::ClosureProposalRecord>(stereo.front()).query, (FrameId{2, 0}));
  StereoCamera one_eye = place::kStreetCamera;
  one_eye.baseline = 0;
  EXPECT_TRUE(look_up_as(one_eye).records.empty());
}

// Such a frame is a place already if the lookup of the older one comes late.
TEST_F(LookUpAs, WhatTheMapTookInLaterIsNoAnswer) {
  for (std::uint32_t i = 0; i < kFrames; ++i) street_.graph.edit_hot({1, i}).journal_sequence = i + 1;
  EXPECT_TRUE(look_up_as(place::kStreetCamera).records.empty()) << "the query was the first";
  for (std::uint32_t i = 0; i < kFrames; ++i) street_.graph.edit_hot({1, i}).journal_sequence = 0;
  EXPECT_EQ(look_up_as(place::kStreetCamera).records.size(), 1u);
}

TEST_F(LookUpAs, WhatIsToldToBeLaterIsNotAskedFor) {
  EXPECT_TRUE(look_up_as(place::kStreetCamera, [] {
                return std::vector<storage::FrameRange>{{1, 0, kFrames}};
              }).records.empty());
}

// Session 2 recognised the street at its frame 5, and goes on elsewhere.
TEST(LookUp, TellsThatNothingOfAPlaceIsSeen) {
  constexpr std::uint32_t kFrames = 20, kRecognised = 5, kNow = 12;
  const auto vocabulary = place::random_vocabulary(200, 50, 1);
  place::PlaceIndex places(vocabulary);
  place::SyntheticStreet street(3, kFrames, 0.3, 2000), elsewhere(4, kFrames, 0.3, 2000);
  for (std::uint32_t i = 0; i < kFrames; ++i) {
    storage::FrameCold& cold = street.graph.edit_cold({1, i});
    cold.words = vocabulary->words(cold.appearance);
    ASSERT_TRUE(places.add({1, i}, cold.words).ok());
  }
  for (std::uint32_t i = 0; i <= kNow; ++i) {
    street.graph.add_frame({2, i});
    if (i > 0) street.graph.add_edge({2, i - 1}, {2, i}, 0, SE3{Matrix3::Identity(), Vector3(0, 0, 0.3)});
  }
  street.graph.add_edge({1, kRecognised}, {2, kRecognised}, 1);
  street.graph.edit_hot({2, kRecognised}).edges.back().verification = storage::Verification::kStereo;
  storage::FrameCold& cold = street.graph.edit_cold({2, kNow});
  std::vector<std::size_t> points;
  cold.appearance = elsewhere.picture(elsewhere.pose(kNow), true, points);
  cold.words = vocabulary->words(cold.appearance);
  place::PictureCache pictures;
  const Lookup found = look_up(street.graph, places, pictures, {2, kNow});
  ASSERT_EQ(found.records.size(), 1u);
  const auto& unseen = std::get<storage::UnseenRecord>(found.records.front());
  EXPECT_EQ(unseen.frame, (FrameId{2, kNow}));
  EXPECT_EQ(unseen.closure, (ClosureId{{2, kRecognised}, 1}));
}

// Photographs of the street, though they are more alike than what a robot saw, take no closure away.
TEST_F(LookUpAs, PhotographsOfAPlaceTakeNoClosureAway) {
  StereoCamera one_eye = place::kStreetCamera;
  one_eye.baseline = 0;
  for (int i = 0; i < 60; ++i) {
    EXPECT_TRUE(look_up_as(one_eye).records.empty());
    ASSERT_TRUE(places_.add({session_, 0}, street_.graph.cold({session_, 0})->words).ok());
  }
  int closures = 0;  // a picture of five may be a bad one
  for (int i = 0; i < 5; ++i) {
    const Lookup found = look_up_as(place::kStreetCamera);
    EXPECT_FALSE(found.contradiction);
    for (const storage::JournalRecord& record : found.records)
      closures += std::get<storage::ClosureProposalRecord>(record).match.session == 1;
  }
  EXPECT_GE(closures, 4);
}

TEST_F(LookUpAs, APictureThatContradictsItsCalibrationProposesNothing) {
  for (const double factor : {0.8, 1.3}) {
    StereoCamera camera = place::kStreetCamera;
    camera.f *= factor;
    const Lookup found = look_up_as(camera);
    EXPECT_TRUE(found.records.empty()) << factor;
    ASSERT_TRUE(found.contradiction) << factor;
    EXPECT_EQ(found.contradiction->what.reason(), Reason::WRONG_CALIBRATION) << factor;
    EXPECT_EQ(found.contradiction->with, 1u) << factor;
  }
  EXPECT_FALSE(look_up_as(place::kStreetCamera).contradiction);
}

// A robot stands where frame kSeenAgain of a street was taken, as frame 0 of session 3. Session 2 is for others.
class LookUpAgain : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 20, kSeenAgain = 10;

  LookUpAgain() {
    for (std::uint32_t i = 0; i < kFrames; ++i) street_.graph.edit_hot({1, i}).journal_sequence = i + 1;
    std::vector<std::size_t> points;
    picture_ = street_.picture(street_.pose(kSeenAgain), true, points);
    words_ = vocabulary_->words(picture_);
    street_.graph.add_session(3, place::kStreetCamera);
    add_frame({3, 0}, picture_, 300);
  }
  void add_frame(FrameId id, std::vector<AppearanceFeature> features, std::uint64_t sequence) {
    storage::FrameHot hot;
    hot.journal_sequence = sequence;
    storage::FrameCold cold;
    cold.words = vocabulary_->words(features);
    cold.appearance = std::move(features);
    street_.graph.add_frame(id, std::move(hot), {}, std::move(cold));
  }
  storage::ClosureProposalRecord proposal() {
    place::PictureCache pictures;
    const auto records = look_up(street_.graph, places_, pictures, {3, 0}).records;
    EXPECT_EQ(records.size(), 1u);
    return records.empty() ? storage::ClosureProposalRecord()
                           : std::get<storage::ClosureProposalRecord>(records.front());
  }

  std::shared_ptr<const place::Vocabulary> vocabulary_ = place::random_vocabulary(200, 50, 1);
  place::SyntheticStreet street_{3, kFrames, 0.3};
  place::PlaceIndex places_{vocabulary_};
  std::vector<AppearanceFeature> picture_;
  std::vector<std::uint32_t> words_;
};

TEST_F(LookUpAgain, ThePlaceWithTheBestFitIsProposed) {
  // Somewhere looks the same by its words, and thirty of its features would fit.
  add_frame({2, 0}, {picture_.begin(), picture_.begin() + 30}, 200);
  ASSERT_TRUE(places_.add({2, 0}, words_).ok());
  std::vector<std::uint32_t> nearly = words_;
  std::erase(nearly, words_.front());
  ASSERT_TRUE(places_.add({1, kSeenAgain}, nearly).ok());
  const place::PlaceAnswer answer = places_.query(words_, street_.graph, {});
  ASSERT_EQ(answer.candidates.size(), 2u);
  ASSERT_EQ(answer.candidates[0].frame, (FrameId{2, 0}));
  ASSERT_GT(answer.candidates[1].probability, 0.05);
  EXPECT_EQ(proposal().match.session, 1u);
}

TEST_F(LookUpAgain, AnOlderViewThatContradictsTheMapIsNotUsed) {
  std::vector<std::size_t> points;
  add_frame({2, 0}, street_.picture(street_.pose(kSeenAgain), true, points), 200);
  ASSERT_TRUE(places_.add({2, 0}, words_).ok());
  street_.graph.add_edge({1, kSeenAgain}, {2, 0}, 1);
  EXPECT_EQ(proposal().match.session, 1u) << "the oldest pass";
  street_.graph.edit_hot({2, 0}).edges.back().T_ab.t.x() = 1;
  EXPECT_EQ(proposal().match.session, 2u) << "a metre off by the map";
}

}  // namespace
}  // namespace relmap::map
