#include "server/place/uniqueness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "server/place/testing/random_vocabulary.h"
#include "server/place/testing/synthetic_street.h"

namespace relmap::place {
namespace {

constexpr StereoCamera kUnknownLens{0, 256, 192, 0, 512, 384};

std::vector<std::uint32_t> features(std::uint32_t first, std::uint32_t count) {
  std::vector<std::uint32_t> result(count);
  std::iota(result.begin(), result.end(), first);
  return result;
}

std::vector<std::uint32_t> operator+(std::vector<std::uint32_t> a, const std::vector<std::uint32_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

PlaceTrial fits(FrameId frame, std::vector<std::uint32_t> seen, bool confirmed = true) {
  VerifiedPlace place;
  place.match = frame;
  place.verification = storage::Verification::kEpipolar;
  place.inliers = static_cast<std::uint32_t>(seen.size());
  place.features = seen;
  if (!confirmed) return {frame, std::move(seen), Status(Reason::TOO_FEW_INLIERS, "")};
  return {frame, std::move(seen), std::move(place)};
}

// Sessions 1 to 9 of 50 frames each, with no edges between them.
class Weigh : public ::testing::Test {
 protected:
  Weigh() {
    for (SessionNumber s = 1; s < 10; ++s) {
      graph_.add_session(s, kUnknownLens);
      for (std::uint32_t i = 0; i < 50; ++i) graph_.add_frame({s, i});
    }
  }
  Standing weigh(const std::vector<PlaceTrial>& trials) {
    return relmap::place::weigh(graph_, {{}, kUnknownLens}, trials, trials.size(), 1).value();
  }
  static bool is_ambiguous(const Standing& standing, const std::vector<PlaceTrial>& trials) {
    return relmap::place::is_ambiguous(standing.uniqueness, trials[standing.best].verified->inliers);
  }

  HandMadeGraph graph_;
};

TEST_F(Weigh, APlaceWithoutRivalsIsUnique) {
  const std::vector<PlaceTrial> trials{fits({1, 5}, {}, false), fits({2, 5}, features(0, 40))};
  const Standing standing = weigh(trials);
  EXPECT_EQ(standing.best, 1u);
  EXPECT_FALSE(standing.runner_up.has_value());
  EXPECT_TRUE(standing.uniqueness.known);
  EXPECT_FALSE(standing.uniqueness.runner_up.valid());
  EXPECT_FALSE(is_ambiguous(standing, trials));
}

TEST_F(Weigh, WhereNothingIsConfirmedNothingStandsOut) {
  const std::vector<PlaceTrial> trials{fits({1, 5}, features(0, 29), false)};
  EXPECT_FALSE(relmap::place::weigh(graph_, {{}, kUnknownLens}, trials, 1, 1).has_value());
  EXPECT_FALSE(relmap::place::weigh(graph_, {{}, kUnknownLens}, {}, 0, 1).has_value());
}

TEST_F(Weigh, LookAlikesAreToldApartByWhatOnlyOneOfThemShows) {
  const auto common = features(0, 40);
  const std::vector<PlaceTrial> few{fits({1, 5}, common + features(100, 8)), fits({2, 5}, common)};
  const Standing ambiguous = weigh(few);
  EXPECT_TRUE(is_ambiguous(ambiguous, few));
  EXPECT_EQ(ambiguous.best, 0u);
  EXPECT_EQ(ambiguous.uniqueness.runner_up, (FrameId{2, 5}));
  EXPECT_EQ(ambiguous.uniqueness.runner_up_inliers, 34u) << "48 x 20 / 28";
  EXPECT_EQ(ambiguous.uniqueness.alike, 1u);
  const std::vector<PlaceTrial> many{fits({1, 5}, common + features(100, 40)), fits({2, 5}, common)};
  EXPECT_FALSE(is_ambiguous(weigh(many), many));
  const std::vector<PlaceTrial> both{fits({1, 5}, common + features(100, 40)),
                                     fits({2, 5}, common + features(200, 30))};
  EXPECT_TRUE(is_ambiguous(weigh(both), both)) << "each shows what the other does not";
}

// `relmap ingest --mono --again` gives another session of the same pictures.
TEST_F(Weigh, APhotographThatWasAddedTwiceIsNoRivalOfItself) {
  const auto seen = features(0, 40);
  const std::vector<PlaceTrial> trials{fits({1, 5}, seen), fits({2, 5}, seen), fits({2, 8}, seen)};
  EXPECT_TRUE(is_ambiguous(weigh(trials), trials));
  for (const std::uint32_t index : {5u, 8u}) {
    AppearanceFeature feature;
    feature.u = static_cast<float>(index);
    for (const SessionNumber session : {1u, 2u}) graph_.edit_cold({session, index}).appearance = {feature};
  }
  const Standing standing = weigh(trials);
  EXPECT_EQ(standing.at_best, (std::vector<bool>{true, true, true}));
  EXPECT_FALSE(standing.uniqueness.runner_up.valid());
  std::swap(graph_.edit_cold({2, 5}), graph_.edit_cold({2, 9}));  // indices differ if pictures were added in between
  const std::vector<PlaceTrial> moved{fits({1, 5}, seen), fits({2, 9}, seen), fits({2, 8}, seen)};
  EXPECT_FALSE(weigh(moved).uniqueness.runner_up.valid());
  std::swap(graph_.edit_cold({2, 5}), graph_.edit_cold({2, 9}));
  graph_.edit_cold({2, 5}).appearance[0].v = 1;  // a different picture
  EXPECT_EQ(weigh(trials).uniqueness.runner_up, (FrameId{2, 5}));
}

// Lookups make no closure between frames between which it stood, so nothing else joins them.
TEST_F(Weigh, WhereTheRobotStandsIsOnePlaceHoweverLong) {
  constexpr std::uint32_t kStood = 25, kDriven = 20;
  graph_.add_session(10, kStereoCamera);
  for (std::uint32_t i = 0; i <= kStood + kDriven + 1; ++i) {
    graph_.add_frame({10, i});
    if (i == 0) continue;
    graph_.add_edge({10, i - 1}, {10, i}, 0);
    storage::Edge& motion = graph_.edit_hot({10, i}).edges.front();
    (i <= kStood ? motion.standing_s : motion.driven_s) = 1;
  }
  const auto seen = features(0, 40);
  for (const std::uint32_t other : {kStood, kStood + kDriven, kStood + kDriven + 1}) {
    const std::vector<PlaceTrial> trials{fits({10, 0}, seen), fits({10, other}, seen)};
    EXPECT_EQ(is_ambiguous(weigh(trials), trials), other > kStood + kDriven) << other;
    const std::vector<PlaceTrial> back{fits({10, other}, seen), fits({10, 0}, seen)};
    EXPECT_EQ(is_ambiguous(weigh(back), back), other > kStood + kDriven) << other;
  }
}

TEST_F(Weigh, FeaturesThatFitAtManyPlacesCountLess) {
  const auto door = features(0, 40);
  std::vector<PlaceTrial> trials{fits({1, 5}, door + features(100, 30))};
  trials.push_back(fits({2, 5}, door));
  EXPECT_EQ(weigh(trials).uniqueness.runner_up_inliers, 28u) << "70 x 20 / 50";
  for (SessionNumber s = 3; s < 8; ++s) trials.push_back(fits({s, 5}, door));
  EXPECT_EQ(weigh(trials).uniqueness.runner_up_inliers, 11u) << "70 x 5.7 / 35.7";
  EXPECT_EQ(weigh(trials).uniqueness.alike, 6u);
}

TEST_F(Weigh, APlaceThatIsNotConfirmedMayBeARival) {
  const std::vector<PlaceTrial> trials{fits({1, 5}, features(0, 32)), fits({2, 5}, features(100, 28), false)};
  const Standing standing = weigh(trials);
  EXPECT_TRUE(is_ambiguous(standing, trials));
  EXPECT_EQ(standing.uniqueness.alike, 0u);
}

TEST_F(Weigh, NeighboursAreNoRivals) {
  const auto seen = features(0, 40);
  const std::vector<PlaceTrial> trials{fits({1, 5}, seen), fits({1, 25}, seen), fits({1, 26}, features(0, 10), false)};
  const Standing standing = weigh(trials);
  EXPECT_EQ(standing.at_best, (std::vector<bool>{true, true, false}));
  EXPECT_EQ(standing.uniqueness.runner_up, (FrameId{1, 26}));
  EXPECT_FALSE(is_ambiguous(standing, trials));
}

TEST_F(Weigh, ARivalThatPicturesTellApartIsDismissed) {
  const auto metric = [](PlaceTrial trial) {
    trial.verified->verification = storage::Verification::kStereo;
    return trial;
  };
  const std::vector<PlaceTrial> trials{metric(fits({1, 5}, features(0, 50))), metric(fits({2, 5}, features(0, 45))),
                                       metric(fits({3, 5}, features(0, 8)))};
  int asked = 0;
  const auto weigh_with = [&](std::uint16_t changed) {
    return relmap::place::weigh(graph_, {{}, kUnknownLens}, trials, trials.size(), 1,
                                [&](const VerifiedPlace& place) {
                                  ++asked;
                                  return place.match == FrameId{2, 5} ? Changes{30, changed} : Changes{30, 0};
                                })
        .value();
  };
  EXPECT_TRUE(is_ambiguous(weigh_with(3), trials)) << "chance makes as many";
  const Standing standing = weigh_with(4);
  EXPECT_FALSE(is_ambiguous(standing, trials));
  EXPECT_EQ(standing.uniqueness.runner_up, (FrameId{3, 5})) << "the next one";
  EXPECT_EQ(standing.uniqueness.alike, 2u) << "geometry confirms both: no closure is beyond doubt here";
  EXPECT_EQ(asked, 4) << "pictures are looked at where there is doubt";
}

TEST_F(Weigh, OnlyAnAnswerCanBeTheBest) {
  const std::vector<PlaceTrial> trials{fits({1, 5}, features(0, 40)), fits({2, 5}, features(0, 50))};
  const auto standing = relmap::place::weigh(graph_, {{}, kUnknownLens}, trials, 1, 1);
  ASSERT_TRUE(standing.has_value());
  EXPECT_EQ(standing->best, 0u);
  EXPECT_TRUE(relmap::place::is_ambiguous(standing->uniqueness, 40));
}

TEST(IsAmbiguous, UnknownUniquenessIsNotAmbiguous) {
  storage::Uniqueness uniqueness;
  EXPECT_FALSE(is_ambiguous(uniqueness, 30));
  uniqueness.runner_up = {1, 1};
  uniqueness.runner_up_inliers = 30;
  EXPECT_FALSE(is_ambiguous(uniqueness, 30));
  uniqueness.known = true;
  EXPECT_TRUE(is_ambiguous(uniqueness, 30));
  EXPECT_FALSE(is_ambiguous(uniqueness, 60));
}

// A street that was passed twice, in sessions 1 and 2, with no edges between the two.
class PassedTwice : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 14, kThere = 7;

  PassedTwice() {
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      std::vector<std::size_t> points;
      storage::FrameCold cold;
      cold.appearance = street_.picture(street_.pose(i), true, points);
      street_.graph.add_frame({2, i}, {}, {}, std::move(cold));
      if (i > 0) street_.graph.add_edge({2, i - 1}, {2, i}, 0, SE3{Matrix3::Identity(), Vector3(0, 0, 0.3)});
    }
    std::vector<std::size_t> points;
    picture_ = street_.picture(street_.pose(kThere), true, points);
  }
  // Replaces what is seen between the shares `first` and `last` of the picture's width.
  static void change(std::vector<AppearanceFeature>& seen, double first, double last) {
    std::mt19937_64 random(5);
    for (AppearanceFeature& feature : seen)
      if (feature.u >= first * kStreetCamera.width && feature.u < last * kStreetCamera.width)
        for (auto& byte : feature.descriptor) byte = static_cast<std::uint8_t>(random() % 90);
  }
  Standing stand() {
    const QueryPicture query{picture_, kStreetCamera};
    std::vector<PlaceTrial> trials;
    for (const SessionNumber s : {1u, 2u}) trials.push_back(try_place(street_.graph, query, {s, kThere}, 3));
    return weigh(street_.graph, query, trials, trials.size(), 3).value();
  }

  SyntheticStreet street_{3, kFrames, 0.3, 900};
  std::vector<AppearanceFeature> picture_;
};

TEST_F(PassedTwice, APlaceIsNoRivalOfItself) {
  const Standing standing = stand();
  EXPECT_EQ(standing.at_best, (std::vector<bool>{true, true}));
  EXPECT_FALSE(standing.uniqueness.runner_up.valid());
  EXPECT_GE(standing.uniqueness.differs, 0);
  EXPECT_LT(standing.uniqueness.differs, 0.05);
}

TEST_F(PassedTwice, PlacesThatDifferInAPartAreRivals) {
  for (std::uint32_t i = 0; i < kFrames; ++i) change(street_.graph.edit_cold({2, i}).appearance, 0, 0.3);
  const Standing standing = stand();
  EXPECT_EQ(standing.at_best, (std::vector<bool>{true, false}));
  EXPECT_EQ(standing.uniqueness.runner_up.session, 2u);
}

TEST_F(PassedTwice, TheDifferingShareIsMeasured) {
  change(picture_, 0.5, 0.8);
  const QueryPicture query{picture_, kStreetCamera};
  const auto place = verify_place(street_.graph, query, {1, kThere}, 3);
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  EXPECT_NEAR(differing_share(street_.graph, query, *place), 0.3, 0.15);
}

TEST(LookAlikes, AreOfOtherPlacesThanTheFrameItself) {
  const auto vocabulary = random_vocabulary(200, 50, 1);
  SyntheticStreet street(3, 30, 0.3);
  PlaceIndex places(vocabulary);
  const auto add = [&](FrameId id, const std::vector<std::uint32_t>& words) {
    street.graph.edit_cold(id).words = words;
    ASSERT_TRUE(places.add(id, words).ok());
  };
  for (std::uint32_t i = 0; i < 30; ++i) add({1, i}, vocabulary->words(street.graph.cold({1, i})->appearance));
  street.graph.add_frame({2, 0});
  add({2, 0}, street.graph.cold({1, 4})->words);
  const auto alike = look_alikes(street.graph, places, {1, 4}, {});
  EXPECT_TRUE(std::any_of(alike.begin(), alike.end(), [](const auto& place) { return place.frame.session == 2; }));
  for (const PlaceCandidate& place : alike)
    EXPECT_TRUE(place.frame.session == 2 || place.frame.index > 24) << place.frame.to_string();
}

}  // namespace
}  // namespace relmap::place
