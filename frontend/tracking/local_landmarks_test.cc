#include "frontend/tracking/local_landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "frontend/tracking/wall_for_test.h"

namespace relmap::tracking {
namespace {

using testing_wall::kCamera;
using testing_wall::Wall;

constexpr double kSigma = 0.2;

class LocalLandmarksTest : public ::testing::Test {
 protected:
  LocalLandmarksTest() { replenish(100); }
  void replenish(int wanted) { landmarks_.replenish(*pair_, corners_, {}, wanted, kSigma, 0, sightings_); }

  Wall wall_{5};
  std::shared_ptr<const Pair> pair_ = wall_.seen(SE3(), 1);
  std::vector<std::vector<vision::Corner>> corners_ = vision::CornerDetector().detect(pair_->left);
  LocalLandmarks landmarks_{kCamera};
  std::vector<Sighting> sightings_;
};

TEST_F(LocalLandmarksTest, StartWhereBothEyesSeeThem) {
  ASSERT_GE(landmarks_.size(), 80u);
  ASSERT_EQ(sightings_.size(), landmarks_.size());
  EXPECT_NEAR(landmarks_.median_depth(), Wall::kDepth, 0.03);
  for (const Sighting& s : sightings_) {
    const Landmark& landmark = landmarks_[s.landmark];
    const Vector3 truth = Wall::point(SE3(), s.pixel.x(), s.pixel.y());
    // Within five sigmas of what it says.
    EXPECT_LT((truth - landmark.point).norm(), 5 * std::sqrt(landmark.covariance.trace()));
    EXPECT_EQ(landmark.age, 0);
  }
  landmarks_.clear();
  EXPECT_EQ(landmarks_.median_depth(), 0);
}

TEST_F(LocalLandmarksTest, AreDroppedWhenMissedThreeTimesAndSightingsAreRenumbered) {
  const std::size_t all = landmarks_.size();
  landmarks_.track_measurements(7, sightings_);  // names them
  std::shuffle(sightings_.begin(), sightings_.end(), std::mt19937(1));
  std::vector<Sighting> seen;
  std::vector<TrackId> names;
  for (const Sighting& s : sightings_)
    if (s.landmark % 3 != 0) {
      seen.push_back(s);
      names.push_back(*landmarks_[s.landmark].track);
    }
  for (int pair = 1; pair <= 3; ++pair) {
    landmarks_.note(seen);
    EXPECT_EQ(landmarks_.size(), pair < 3 ? all : names.size());
    ASSERT_EQ(seen.size(), names.size());
    for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(*landmarks_[seen[i].landmark].track, names[i]);
  }
}

TEST_F(LocalLandmarksTest, StayWhenFoundAgain) {
  const std::size_t all = landmarks_.size();
  std::vector<Sighting> none;
  for (int round = 0; round < 3; ++round) {
    landmarks_.note(none);
    landmarks_.note(none);
    landmarks_.note(sightings_);
    EXPECT_EQ(landmarks_.size(), all);
  }
  for (int pair = 0; pair < 3; ++pair) landmarks_.note(none);
  EXPECT_EQ(landmarks_.size(), 0u);
}

TEST_F(LocalLandmarksTest, MoveToTheNewKeyframeAndReduceTheirCovariance) {
  const SE3 there{so3_exp({0, 0.02, 0}), {0.1, 0, 0.2}};
  const auto pair = wall_.seen(there, 2);
  double before = 0;
  std::vector<Vector3> truth;
  for (Sighting& s : sightings_) {
    truth.push_back(there.inverse() * Wall::point(SE3(), s.pixel.x(), s.pixel.y()));
    s.pixel = kCamera.project(truth.back());
    before += landmarks_[s.landmark].covariance.trace();
  }
  landmarks_.rebase(there, *pair, kSigma, sightings_);
  double after = 0;
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    const Landmark& landmark = landmarks_[sightings_[i].landmark];
    after += landmark.covariance.trace();
    EXPECT_LT((landmark.point - truth[i]).norm(), 4 * std::sqrt(landmark.covariance.trace()));
    EXPECT_EQ(landmark.age, 1);
  }
  EXPECT_LT(after, 0.8 * before);
}

TEST_F(LocalLandmarksTest, PassedOnesAreNotInKeyframesAndSoonDropped) {
  const auto pair = wall_.seen(SE3(), 2);
  landmarks_.rebase({Matrix3::Identity(), {0, 0, Wall::kDepth + 0.5}}, *pair, kSigma, sightings_);
  EXPECT_TRUE(sightings_.empty());
  landmarks_.note(sightings_);
  EXPECT_EQ(landmarks_.size(), 0u);
}

TEST_F(LocalLandmarksTest, TracksKeepTheNameFromTheirFirstKeyframe) {
  const auto first = landmarks_.track_measurements(4, sightings_);
  ASSERT_EQ(first.size(), sightings_.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].track, (TrackId{4, static_cast<std::uint32_t>(i)}));
    EXPECT_EQ(first[i].level, landmarks_[sightings_[i].landmark].level);
  }
  const std::size_t old = sightings_.size();
  sightings_[0].pixel.z() = kNoRight;
  replenish(140);
  ASSERT_GT(sightings_.size(), old);
  const auto second = landmarks_.track_measurements(5, sightings_);
  for (std::size_t i = 0; i < second.size(); ++i)
    EXPECT_EQ(second[i].track, i < old ? first[i].track : (TrackId{5, static_cast<std::uint32_t>(i)}));
  EXPECT_TRUE(is_mono(second[0].pixel()));
  EXPECT_FALSE(is_mono(second[1].pixel()));
}

// Although coarse landmarks are lost more often here and fine levels always have corners, each level keeps its share.
TEST_F(LocalLandmarksTest, LevelsKeepTheirShareThroughManyReplenishments) {
  const auto by_level = [&] {
    std::array<int, 4> counts{};
    for (const Sighting& s : sightings_) ++counts[static_cast<std::size_t>(landmarks_[s.landmark].level)];
    return counts;
  };
  const auto at_first = by_level();
  EXPECT_GT(at_first[0], at_first[1]);
  EXPECT_GT(at_first[1], at_first[2]);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int keyframe = 0; keyframe < 50; ++keyframe) {
    std::erase_if(sightings_,
                  [&](const Sighting& s) { return unit(random) < (landmarks_[s.landmark].level == 0 ? 0.15 : 0.4); });
    for (int pair = 0; pair < 3; ++pair) landmarks_.note(sightings_);
    replenish(100);
    EXPECT_EQ(sightings_.size(), landmarks_.size());
    EXPECT_LE(landmarks_.size(), 110u);
    const auto now = by_level();
    EXPECT_GE(now[1], 0.7 * at_first[1]) << keyframe;
    EXPECT_GE(now[2], 0.7 * at_first[2]) << keyframe;
    EXPECT_GE(now[0], 0.7 * at_first[0]) << keyframe;
  }
}

}  // namespace
}  // namespace relmap::tracking
