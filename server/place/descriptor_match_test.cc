#include "server/place/descriptor_match.h"

#include <gtest/gtest.h>

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

TEST(MatchPoints, OnlyPossiblePairsCompete) {
  const Twins twins;
  const auto matches =
      match_points({&twins.feature, 1}, twins.points, [](std::uint32_t, std::uint32_t p) { return p == 1; });
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].feature, 0u);
  EXPECT_EQ(matches[0].point, 1u);
  EXPECT_EQ(matches[0].distance, 0u);
  EXPECT_TRUE(
      match_points({&twins.feature, 1}, twins.points, [](std::uint32_t, std::uint32_t) { return false; }).empty());
}

}  // namespace
}  // namespace relmap::place
