#include "server/place/descriptor_match.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include "server/place/descriptor_sketch.h"

namespace relmap::place {
namespace {

// Two points that look alike but are metres apart, and a feature that looks like both.
struct Twins {
  Twins() {
    feature.descriptor.fill(40);
    looks = feature.descriptor;
    for (const double x : {0.0, 5.0}) {
      MapPoint point;
      point.point = {x, 0, 10};
      point.covariance = 1e-4 * Matrix3::Identity();
      point.descriptor = &looks;
      points.push_back(point);
    }
  }
  AppearanceFeature feature;
  Descriptor looks;
  std::vector<MapPoint> points;
};

TEST(MatchPoints, AFeatureThatLooksLikeTwoPointsIsNotMatched) {
  const Twins twins;
  EXPECT_TRUE(match_points({&twins.feature, 1}, twins.points).empty());
}

TEST(MatchPoints, OnlyPointsThatAreExpectedNearCompete) {
  Twins twins;
  twins.feature.u = 100;
  twins.feature.v = 50;
  ExpectedPoints expected{{{130, 50}, {104, 53}}, 6};
  const auto matches = match_points({&twins.feature, 1}, twins.points, &expected);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].feature, 0u);
  EXPECT_EQ(matches[0].point, 1u);
  EXPECT_EQ(matches[0].distance, 0u);
  expected.radius = 5;  // exactly as far, which is not nearer
  EXPECT_TRUE(match_points({&twins.feature, 1}, twins.points, &expected).empty());
}

TEST(DropOutdone, DropsWhatLooksFarMoreLikeAnotherPointUnlessThatIsTheSame) {
  Twins twins;  // two points that look like the feature
  std::vector<DescriptorMatch> matches{{0, 1, 100}};
  drop_outdone({&twins.feature, 1}, twins.points, 0, matches);
  EXPECT_EQ(matches.size(), 1u) << "no rivals";
  drop_outdone({&twins.feature, 1}, twins.points, 1, matches);
  EXPECT_TRUE(matches.empty());
  matches = {{0, 1, 0}};
  drop_outdone({&twins.feature, 1}, twins.points, 2, matches);
  EXPECT_EQ(matches.size(), 1u) << "nothing looks more like it";
  twins.points[0].point = twins.points[1].point;
  matches = {{0, 1, 100}};
  drop_outdone({&twins.feature, 1}, twins.points, 2, matches);
  EXPECT_EQ(matches.size(), 1u) << "one point of the world";
}

TEST(DropOutdone, TheOtherPointMustWinTheRatioTest) {
  Twins twins;
  twins.feature.descriptor[0] += 8;  // both points are at a squared distance of 64
  std::vector<DescriptorMatch> matches{{0, 1, 99}};
  drop_outdone({&twins.feature, 1}, twins.points, 1, matches);
  EXPECT_EQ(matches.size(), 1u) << "more than 0.8 times as far";
  matches = {{0, 1, 101}};
  drop_outdone({&twins.feature, 1}, twins.points, 1, matches);
  EXPECT_TRUE(matches.empty());
}

// As match_descriptors() says, from the distances of all pairs.
std::vector<DescriptorMatch> by_all_pairs(std::span<const AppearanceFeature> features,
                                          std::span<const Descriptor* const> points,
                                          const std::function<bool(std::uint32_t, std::uint32_t)>& same,
                                          const ExpectedPoints* expected) {
  constexpr std::uint32_t kImpossible = ~0u;
  const auto distance = [&](std::uint32_t f, std::uint32_t p) {
    const Vector2 seen(features[f].u, features[f].v);
    if (expected && !((seen - expected->at[p]).squaredNorm() < expected->radius * expected->radius)) return kImpossible;
    return squared_distance(features[f].descriptor, *points[p]);
  };
  std::vector<DescriptorMatch> matches;
  for (std::uint32_t f = 0; f < features.size(); ++f) {
    std::uint32_t best = 0, mutual = 0;
    for (std::uint32_t p = 1; p < points.size(); ++p)
      if (distance(f, p) < distance(f, best)) best = p;
    for (std::uint32_t g = 1; g < features.size(); ++g)
      if (distance(g, best) < distance(mutual, best)) mutual = g;
    if (mutual != f || distance(f, best) > kMaxDescriptorDistance) continue;
    const double rival = distance(f, best) / (kDescriptorRatio * kDescriptorRatio);
    bool clear = true;
    for (std::uint32_t p = 0; p < points.size(); ++p)
      clear = clear && (p == best || distance(f, p) > rival || same(best, p));
    if (clear) matches.push_back({f, best, distance(f, best)});
  }
  return matches;
}

// Features of points that are seen several times, beside features of nothing; many descriptors are about as far apart
// as a match may be.
TEST(MatchDescriptors, FindsWhatTheDistancesOfAllPairsFind) {
  std::mt19937 random(1);
  const auto noise = [&](int most) { return static_cast<int>(random() % (2 * most + 1)) - most; };
  std::size_t found = 0, of_pairs = 0;
  for (int run = 0; run < 40; ++run) {
    std::vector<Descriptor> seen(30), of_points;
    for (Descriptor& descriptor : seen)
      for (auto& byte : descriptor)
        byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() % 160 : random() % 40);
    const int most = 5 + 2 * run;  // up to 83: twice as much as a match allows
    const auto changed = [&](Descriptor descriptor) {
      for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(std::clamp(byte + noise(most), 0, 255));
      return descriptor;
    };
    ExpectedPoints expected{{}, 60};
    std::vector<AppearanceFeature> features(50);
    for (std::size_t f = 0; f < features.size(); ++f) {
      features[f].u = static_cast<float>(f % 10) * 40;
      features[f].v = static_cast<float>(f / 10) * 40;
      features[f].descriptor = changed(seen[f % seen.size()]);
    }
    for (int p = 0; p < 120; ++p) {
      const std::size_t of = random() % seen.size();
      of_points.push_back(p % 40 == 0 ? of_points.empty() ? seen[of] : of_points.front() : changed(seen[of]));  // ties
      expected.at.emplace_back(features[of].u + noise(80), features[of].v + noise(80));
    }
    std::vector<const Descriptor*> points;
    for (const Descriptor& descriptor : of_points) points.push_back(&descriptor);
    const auto same = [&](std::uint32_t p, std::uint32_t q) { return (p ^ q) % 4 == 0; };
    for (const ExpectedPoints* where : {static_cast<const ExpectedPoints*>(nullptr), &std::as_const(expected)}) {
      const auto fast = match_descriptors(features, points, same, where);
      const auto slow = by_all_pairs(features, points, same, where);
      ASSERT_EQ(fast.size(), slow.size()) << "run " << run;
      for (std::size_t i = 0; i < fast.size(); ++i)
        EXPECT_EQ(std::tie(fast[i].feature, fast[i].point, fast[i].distance),
                  std::tie(slow[i].feature, slow[i].point, slow[i].distance));
      found += fast.size();
      of_pairs += features.size();
    }
  }
  EXPECT_GT(found, of_pairs / 20);
  EXPECT_LT(found, of_pairs / 2);
}

bool rules_out(std::uint32_t max_squared, const Descriptor& a, const Descriptor& b) {
  const std::array<const Descriptor*, 6> all{&b, &b, &a, &a, &a, &b};
  const DescriptorSketches sketches(all);
  std::vector<std::uint32_t> near;
  sketches.find_near(sketch(a), max_squared, near);
  const std::vector<std::uint32_t> equal{2, 3, 4}, every{0, 1, 2, 3, 4, 5};
  EXPECT_TRUE(near == equal || near == every) << "all of them, in order";
  return near == equal;
}

TEST(DescriptorSketch, NeverRulesOutWhatIsNear) {
  std::mt19937 random(2);
  std::size_t ruled_out = 0;
  for (int run = 0; run < 20'000; ++run) {
    Descriptor a, b;
    const int most = 1 + run % 255;
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = static_cast<std::uint8_t>(random() % 256);
      b[i] = static_cast<std::uint8_t>(
          run % 3 == 0 ? random() % 2 * 255
                       : std::clamp(a[i] + static_cast<int>(random() % (2 * most + 1)) - most, 0, 255));
    }
    const std::uint32_t distance = squared_distance(a, b);
    EXPECT_FALSE(rules_out(distance, a, b));
    ruled_out += rules_out(distance / 8, a, b);
  }
  EXPECT_GT(ruled_out, 10'000u);
  Descriptor none{}, full;
  full.fill(255);
  const std::uint32_t most = squared_distance(none, full);
  EXPECT_FALSE(rules_out(most, none, full));
  EXPECT_TRUE(rules_out(most - 1, none, full)) << "all of the difference is in the sketch";
}

// What has another word does not compete, so the words can be matched one by one.
TEST(MatchPoints, ByWordEachWordIsMatchedByItself) {
  constexpr std::uint32_t kWords = 5;
  std::mt19937_64 random(8);
  std::vector<Descriptor> looks(60);
  for (Descriptor& descriptor : looks)
    for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(random() % 60);
  std::vector<MapPoint> points;
  std::vector<AppearanceFeature> features;
  std::vector<std::uint32_t> words;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    MapPoint point;
    point.point = {static_cast<double>(i), 0, 10};
    point.covariance = 1e-4 * Matrix3::Identity();
    point.descriptor = &looks[i];
    point.word = i % 7 == 0 ? kNoWord : static_cast<std::uint32_t>(random() % kWords);
    points.push_back(point);
    AppearanceFeature feature;
    feature.descriptor = looks[random() % looks.size()];
    features.push_back(feature);
    words.push_back(static_cast<std::uint32_t>(random() % kWords));
  }
  std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> expected, found;
  for (std::uint32_t word = 0; word < kWords; ++word) {
    std::vector<std::uint32_t> feature_of, point_of;
    std::vector<AppearanceFeature> of_features;
    std::vector<MapPoint> of_points;
    for (std::uint32_t i = 0; i < looks.size(); ++i) {
      if (words[i] == word) feature_of.push_back(i), of_features.push_back(features[i]);
      if (points[i].word == word) point_of.push_back(i), of_points.push_back(points[i]);
    }
    for (const DescriptorMatch& match : match_points(of_features, of_points))
      expected.emplace_back(feature_of[match.feature], point_of[match.point], match.distance);
  }
  for (const DescriptorMatch& match : match_points_by_word(features, words, points))
    found.emplace_back(match.feature, match.point, match.distance);
  std::ranges::sort(expected);
  EXPECT_GT(found.size(), 5u);
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace relmap::place
