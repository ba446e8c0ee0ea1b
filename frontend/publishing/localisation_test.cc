#include "frontend/publishing/localisation.h"

#include <gtest/gtest.h>

namespace relmap::publishing {
namespace {

constexpr SessionNumber kMine = 2, kOther = 1;

class LocalisationTest : public testing::Test {
 protected:
  // Keyframes 1 m apart along z.
  void drive(std::uint32_t count, MotionSource source = MotionSource::kVision) {
    for (; count > 0; --count, ++next_) {
      Keyframe keyframe;
      keyframe.sequence = next_;
      keyframe.source = next_ == 0 ? MotionSource::kStart : source;
      keyframe.T_odom_frame.t = Vector3(0, 0, next_);
      localisation_.publishing(keyframe);
    }
  }
  std::optional<Localisation::Recovery> hear(std::uint32_t keyframe, FrameId frame,
                                             PoseNews::Kind kind = PoseNews::Kind::kClosure) {
    PoseNews news;
    news.kind = kind;
    news.keyframe = {kMine, keyframe};
    news.frame = frame;
    news.T_frame_keyframe.t = Vector3(0.5, 0, 0);
    return localisation_.hear(news);
  }

  Localisation localisation_;
  std::uint32_t next_ = 0;
};

TEST_F(LocalisationTest, AClosureAndTheOdometrySinceTellThePlace) {
  drive(10);
  EXPECT_FALSE(localisation_.place());
  EXPECT_FALSE(hear(7, {kOther, 3}));  // nothing had been lost
  const auto place = localisation_.place();
  ASSERT_TRUE(place);
  EXPECT_EQ(place->frame, (FrameId{kOther, 3}));
  EXPECT_EQ(place->recognised, (FrameId{kMine, 7}));
  EXPECT_LT((place->T_frame_newest.t - Vector3(0.5, 0, 2)).norm(), 1e-12);
  EXPECT_FALSE(hear(5, {kOther, 1}));  // news of an older keyframe comes late
  EXPECT_EQ(localisation_.place()->frame, (FrameId{kOther, 3}));
  EXPECT_EQ(localisation_.counts().closures, 2u);
}

TEST_F(LocalisationTest, AfterAnUnmeasuredStepThePlaceIsUnknownUntilAKeyframeBehindItIsRecognised) {
  drive(50);
  hear(49, {kMine, 4});
  ASSERT_TRUE(localisation_.place());
  drive(1, MotionSource::kConstantVelocity);  // 50
  drive(9);
  EXPECT_FALSE(localisation_.place());
  EXPECT_FALSE(hear(49, {kMine, 5}));   // of before the step
  EXPECT_FALSE(hear(59, {kMine, 52}));  // both ends behind it: its error remains
  EXPECT_EQ(localisation_.counts().recovered_steps, 0u);
  const auto recovery = hear(55, {kMine, 6});
  ASSERT_TRUE(recovery);
  EXPECT_EQ(recovery->keyframe, (FrameId{kMine, 55}));
  EXPECT_EQ(recovery->frame, (FrameId{kMine, 6}));
  EXPECT_EQ(recovery->steps, 1u);
  EXPECT_DOUBLE_EQ(recovery->distance_m, 0.5);
  EXPECT_TRUE(localisation_.place());
  EXPECT_FALSE(hear(56, {kMine, 7})) << "it is closed already";
  EXPECT_EQ(localisation_.counts().unmeasured_steps, 1u);
  EXPECT_EQ(localisation_.counts().recovered_steps, 1u);
}

TEST_F(LocalisationTest, AnotherSessionsFrameClosesAllStepsBeforeTheKeyframe) {
  drive(10);
  drive(3, MotionSource::kGyro);  // 10, 11, 12
  drive(5);
  drive(1, MotionSource::kUnsensed);  // 18
  drive(2);
  const auto recovery = hear(15, {kOther, 900});
  ASSERT_TRUE(recovery);
  EXPECT_EQ(recovery->steps, 3u);
  EXPECT_FALSE(localisation_.place()) << "18 came after keyframe 15";
  EXPECT_EQ(hear(19, {kOther, 904})->steps, 1u);
  EXPECT_TRUE(localisation_.place());
}

TEST_F(LocalisationTest, AClosureThatIsTakenOutNoLongerSaysWhereTheRobotIs) {
  drive(30);
  hear(20, {kOther, 5});
  hear(25, {kOther, 9});
  hear(25, {kOther, 9}, PoseNews::Kind::kClosureOut);
  EXPECT_EQ(localisation_.place()->frame, (FrameId{kOther, 5}));
  hear(20, {kOther, 5}, PoseNews::Kind::kClosureOut);
  EXPECT_FALSE(localisation_.place());
  EXPECT_EQ(localisation_.counts().withdrawn, 2u);
}

TEST_F(LocalisationTest, AClosureThatIsTakenOutBridgesNoStep) {
  drive(30);
  drive(1, MotionSource::kConstantVelocity);  // 30
  drive(9);
  EXPECT_TRUE(hear(35, {kMine, 3}));
  EXPECT_FALSE(hear(36, {kMine, 4}));
  hear(35, {kMine, 3}, PoseNews::Kind::kClosureOut);
  EXPECT_EQ(localisation_.counts().recovered_steps, 1u) << "the other still reaches across";
  hear(36, {kMine, 4}, PoseNews::Kind::kClosureOut);
  hear(36, {kMine, 4}, PoseNews::Kind::kClosureOut);  // said twice
  EXPECT_EQ(localisation_.counts().recovered_steps, 0u);
  EXPECT_EQ(localisation_.counts().withdrawn, 2u);
  EXPECT_FALSE(localisation_.place());
  EXPECT_EQ(hear(37, {kMine, 5})->steps, 1u);
  EXPECT_FALSE(hear(37, {kMine, 5})) << "said twice";
  EXPECT_EQ(localisation_.counts().recovered_steps, 1u);
}

TEST_F(LocalisationTest, TheWithdrawalOfAnUnknownClosureDoesNotCount) {
  drive(10);
  hear(5, {kOther, 5}, PoseNews::Kind::kClosureOut);
  EXPECT_EQ(localisation_.counts().withdrawn, 0u);
}

TEST_F(LocalisationTest, ClosuresOfTheMapBeforeAreForgotten) {
  drive(10);
  drive(1, MotionSource::kGyro);  // 10
  drive(9);
  EXPECT_TRUE(hear(15, {kOther, 5}));
  PoseNews news;
  news.kind = PoseNews::Kind::kClosure;
  news.keyframe = {kMine + 7, 8};
  news.frame = {kOther, 2};
  EXPECT_FALSE(localisation_.hear(news));
  EXPECT_FALSE(localisation_.place());
  EXPECT_EQ(localisation_.counts().recovered_steps, 0u);
  news.keyframe.index = 16;
  EXPECT_TRUE(localisation_.hear(news));
}

TEST_F(LocalisationTest, ManyLateNewsOfOldKeyframesLeaveTheNewest) {
  drive(4000);
  hear(3999, {kOther, 5});
  for (std::uint32_t i = 0; i < 3900; ++i) hear(i, {kOther, 6}), hear(i, {kOther, 7});
  EXPECT_EQ(localisation_.place()->recognised, (FrameId{kMine, 3999}));
}

TEST_F(LocalisationTest, AClosureThatIsForgottenBridgesNoStep) {
  drive(10);
  drive(1, MotionSource::kConstantVelocity);  // 10
  drive(5000);
  ASSERT_TRUE(hear(15, {kMine, 3}));
  for (std::uint32_t i = 100; i < 100 + 4095; ++i) hear(i, {kMine, 50});
  EXPECT_EQ(localisation_.counts().recovered_steps, 1u) << "4,096 closures are kept";
  hear(100 + 4095, {kMine, 50});
  EXPECT_EQ(localisation_.counts().recovered_steps, 0u);
  hear(15, {kMine, 3}, PoseNews::Kind::kClosureOut);
  EXPECT_EQ(localisation_.counts().withdrawn, 0u);

  // It is older than all that are kept, so it is not taken in again.
  EXPECT_FALSE(hear(15, {kMine, 3}));
  EXPECT_EQ(localisation_.counts().closures, 4097u);
  EXPECT_EQ(localisation_.counts().recovered_steps, 0u);

  ASSERT_TRUE(hear(4500, {kMine, 4}));
  EXPECT_EQ(localisation_.counts().recovered_steps, 1u);
  hear(4500, {kMine, 4}, PoseNews::Kind::kClosureOut);
  EXPECT_EQ(localisation_.counts().recovered_steps, 0u);
}

TEST_F(LocalisationTest, NewsOfAnUnknownKeyframeGiveNoPlace) {
  hear(5, {kOther, 5});
  EXPECT_FALSE(localisation_.place());
  drive(10'000);
  hear(5, {kOther, 5});  // long forgotten
  EXPECT_FALSE(localisation_.place());
  hear(9'999, {kOther, 5});
  EXPECT_TRUE(localisation_.place());
}

TEST_F(LocalisationTest, OtherNewsAreNoClosures) {
  drive(10);
  hear(5, {kOther, 5}, PoseNews::Kind::kLocalised);
  hear(5, {}, PoseNews::Kind::kSlowDown);
  EXPECT_FALSE(localisation_.place());
  EXPECT_EQ(localisation_.counts().closures, 0u);
}

}  // namespace
}  // namespace relmap::publishing
