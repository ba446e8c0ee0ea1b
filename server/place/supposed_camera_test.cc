#include "server/place/supposed_camera.h"

#include <gtest/gtest.h>

#include "server/place/testing/random_vocabulary.h"
#include "server/place/testing/synthetic_street.h"

namespace relmap::place {
namespace {

constexpr FrameId kNear{1, 6};

// A street that one session drove through, and a single picture of it for which a longer lens is supposed than took it.
class SupposedCamera : public ::testing::Test {
 protected:
  SupposedCamera() {
    std::vector<std::size_t> points;
    for (std::uint32_t i = 0; i < kFrames; ++i)
      EXPECT_TRUE(index_.add({1, i}, vocabulary_->words(street_.graph.cold({1, i})->appearance)).ok());
    SE3 pose = street_.pose(kNear.index);
    pose.t.x() += 0.1;
    features_ = street_.picture(pose, false, points);
    supposed_ = kStreetCamera;
    supposed_.f *= 1.2;
    supposed_.baseline = 0;
    unknown_ = supposed_;
    unknown_.f = 0;
  }
  PlaceQuestion question(const StereoCamera& camera, CameraKnown known) const {
    return {features_, camera, {}, kNear, false, known};
  }
  DescribeWithoutCamera describe() {
    return [this]() -> Result<PlaceQuestion> {
      ++described_;
      return question(unknown_, CameraKnown::kNamed);
    };
  }
  Result<Localisation> localise(const StereoCamera& camera, CameraKnown known, const DescribeWithoutCamera& again) {
    return localise_features(map_, question(camera, known), again, [] { return Status(); });
  }
  Result<PlaceMatches> match(const StereoCamera& camera, CameraKnown known, const DescribeWithoutCamera& again) {
    return match_features(map_, question(camera, known), again, 5, [] { return Status(); });
  }

  static constexpr std::uint32_t kFrames = 12;
  SyntheticStreet street_{1, kFrames, 0.3};
  const std::shared_ptr<const Vocabulary> vocabulary_ = random_vocabulary(500, 60, 1);
  PlaceIndex index_{vocabulary_};
  const PlaceKnowledge map_{street_.graph, index_, *vocabulary_};
  std::vector<AppearanceFeature> features_;
  StereoCamera supposed_, unknown_;
  int described_ = 0;
};

TEST_F(SupposedCamera, AWrongOneIsReplacedByAnUnknownCamera) {
  ASSERT_EQ(localise(supposed_, CameraKnown::kSupposed, {}).reason(), Reason::WRONG_CALIBRATION);
  const auto found = localise(supposed_, CameraKnown::kSupposed, describe());
  ASSERT_TRUE(found.ok()) << found.status().to_string();
  EXPECT_EQ(described_, 1);
  EXPECT_NEAR(found->place.focal_length, kStreetCamera.f, 0.04 * kStreetCamera.f);

  ASSERT_EQ(match(supposed_, CameraKnown::kSupposed, {}).or_throw().nothing_verified.reason(),
            Reason::WRONG_CALIBRATION);
  const auto matches = match(supposed_, CameraKnown::kSupposed, describe());
  ASSERT_TRUE(matches.ok()) << matches.status().to_string();
  EXPECT_EQ(described_, 2);
  EXPECT_NE(matches->nothing_verified.reason(), Reason::WRONG_CALIBRATION);
  ASSERT_FALSE(matches->places.empty());
  ASSERT_TRUE(matches->places.front().verified.has_value()) << matches->nothing_verified.to_string();
  EXPECT_NEAR(matches->places.front().verified->focal_length, kStreetCamera.f, 0.04 * kStreetCamera.f);
}

TEST_F(SupposedCamera, ARightOneIsNotAskedAboutAgain) {
  StereoCamera right = supposed_;
  right.f = kStreetCamera.f;
  const auto found = localise(right, CameraKnown::kSupposed, describe());
  ASSERT_TRUE(found.ok()) << found.status().to_string();
  EXPECT_TRUE(match(right, CameraKnown::kSupposed, describe()).ok());
  EXPECT_EQ(described_, 0);
}

TEST_F(SupposedCamera, ANamedOneIsRefusedWhereItIsWrong) {
  EXPECT_EQ(localise(supposed_, CameraKnown::kNamed, describe()).reason(), Reason::WRONG_CALIBRATION);
  EXPECT_EQ(match(supposed_, CameraKnown::kNamed, describe()).or_throw().nothing_verified.reason(),
            Reason::WRONG_CALIBRATION);
  EXPECT_EQ(described_, 0);
}

TEST_F(SupposedCamera, APictureThatCannotBeDescribedWithoutItIsRefusedForThatReason) {
  const DescribeWithoutCamera fails = []() -> Result<PlaceQuestion> { return {Reason::PICTURE_DAMAGED, "cut"}; };
  EXPECT_EQ(localise(supposed_, CameraKnown::kSupposed, fails).reason(), Reason::PICTURE_DAMAGED);
  EXPECT_EQ(match(supposed_, CameraKnown::kSupposed, fails).reason(), Reason::PICTURE_DAMAGED);
}

}  // namespace
}  // namespace relmap::place
