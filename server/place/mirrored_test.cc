#include "server/place/mirrored.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "frontend/vision/appearance.h"
#include "frontend/vision/textures_for_test.h"
#include "server/place/testing/synthetic_street.h"

namespace relmap::place {
namespace {

int difference(const AppearanceFeature& a, const AppearanceFeature& b) {
  int sum = 0;
  for (std::size_t i = 0; i < a.descriptor.size(); ++i)
    sum += (a.descriptor[i] - b.descriptor[i]) * (a.descriptor[i] - b.descriptor[i]);
  return sum;
}

// The features that the detector finds in the mirror image of a picture.
TEST(Mirrored, FeaturesAreThoseOfTheMirrorImage) {
  constexpr int kWidth = 320, kHeight = 240;
  const vision::testing_textures::Waves waves(3);
  const vision::Image picture =
      vision::testing_textures::paint(kWidth, kHeight, [&](int x, int y) { return waves.at(x, y); });
  const vision::Image mirror =
      vision::testing_textures::paint(kWidth, kHeight, [&](int x, int y) { return waves.at(kWidth - 1 - x, y); });
  const auto expected = vision::detect_appearance(mirror);
  int there = 0, alike = 0, unlike_unmirrored = 0;
  const auto plain = vision::detect_appearance(picture);
  const auto turned = mirrored(plain, kWidth);
  ASSERT_GT(turned.size(), 100u);
  for (std::size_t i = 0; i < turned.size(); ++i)
    for (const AppearanceFeature& other : expected) {
      const double turn = std::remainder(turned[i].angle - other.angle, 2 * M_PI);
      if (std::hypot(turned[i].u - other.u, turned[i].v - other.v) > 0.5 || std::abs(turn) > 0.1 ||
          std::abs(turned[i].scale / other.scale - 1) > 0.1)
        continue;
      ++there;
      alike += difference(turned[i], other) < 100 * 100;
      unlike_unmirrored += difference(plain[i], other) > 100 * 100;
      break;
    }
  EXPECT_GT(there, static_cast<int>(turned.size()) / 2);
  EXPECT_GE(alike, there * 9 / 10);
  EXPECT_GE(unlike_unmirrored, there * 9 / 10);
}

TEST(Mirrored, AMirroredPictureIsRefused) {
  constexpr FrameId kPlace{1, 6};
  SyntheticStreet street(2, 12, 0);
  std::vector<std::size_t> points;
  const auto features = street.picture(street.pose(6), false, points);
  QueryPicture plain{features, kStreetCamera};
  plain.camera.baseline = 0;
  VerifiedPlace place;  // as a symmetric pattern may give it
  place.match = kPlace;
  place.inliers = 25;
  place.verification = storage::Verification::kPnP;
  EXPECT_TRUE(check_not_mirrored(street.graph, plain, place, 7).ok());

  const auto turned = mirrored(features, kStreetCamera.width);
  QueryPicture mirror = plain;
  mirror.features = turned;
  mirror.camera.cx = kStreetCamera.width - 1 - kStreetCamera.cx;
  const Status refused = check_not_mirrored(street.graph, mirror, place, 7);
  EXPECT_EQ(refused.reason(), Reason::NO_CALIBRATION) << refused.to_string();
  EXPECT_NE(refused.message().find("mirrored"), std::string::npos) << refused.message();
  place.inliers = 200;
  EXPECT_TRUE(check_not_mirrored(street.graph, mirror, place, 7).ok()) << "so many inliers do not occur by chance";
}

}  // namespace
}  // namespace relmap::place
