#include "frontend/tracking/matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "frontend/tracking/local_landmarks.h"
#include "frontend/tracking/wall_for_test.h"

namespace relmap::tracking {
namespace {

using testing_wall::kCamera;
using testing_wall::Wall;

class Matching : public ::testing::Test {
 protected:
  Matching() {
    const auto pair = wall_.seen(SE3(), 1);
    landmarks_.replenish(*pair, detector_.detect(pair->left), {}, 100, 0.3, 0, starts_);
  }

  // Where a camera at `T_wall_camera` sees a landmark.
  StereoPixel truth(std::uint32_t landmark, const SE3& T_wall_camera) const {
    const StereoPixel& start = starts_[landmark].pixel;
    return kCamera.project(T_wall_camera.inverse() * Wall::point(SE3(), start.x(), start.y()));
  }
  // Pixels of the level between a sighting and the truth.
  double error(const Sighting& s, const SE3& T_wall_camera) const {
    return (s.pixel - truth(s.landmark, T_wall_camera)).head<2>().norm() / pixel_sigma(level(s));
  }
  int level(const Sighting& s) const { return landmarks_[s.landmark].level; }
  ExpectedPatches expected(const SE3& T_wall_camera = {}) const {
    return {landmarks_.all(), T_wall_camera.inverse(), kCamera, 3};
  }
  std::size_t right(const std::vector<Sighting>& sightings, const SE3& T_wall_camera, double pixels) const {
    return static_cast<std::size_t>(std::count_if(
        sightings.begin(), sightings.end(), [&](const Sighting& s) { return error(s, T_wall_camera) <= pixels; }));
  }
  static SE3 moved(double u) { return {Matrix3::Identity(), {u * Wall::kDepth / kCamera.f, 0, 0}}; }  // by pixels

  Wall wall_{3};
  vision::CornerDetector detector_;
  LocalLandmarks landmarks_{kCamera};
  std::vector<Sighting> starts_;
};

TEST_F(Matching, StartsWithLandmarksOnEveryLevel) {
  ASSERT_GE(landmarks_.size(), 80u);
  std::array<int, 3> levels{};
  for (const Sighting& s : starts_) ++levels[static_cast<std::size_t>(level(s))];
  for (const int count : levels) EXPECT_GE(count, 5);
}

TEST_F(Matching, SearchFindsWhatLiesWithinTheRadius) {
  const SE3 there = moved(7);
  const auto pair = wall_.seen(there, 2);
  const auto sightings = search_around(expected(), SE3(), kCamera, pair->left, 9);
  EXPECT_EQ(sightings.size(), 48u);  // enough for a pose, the coarse ones first
  EXPECT_EQ(level(sightings.front()), 2);
  EXPECT_GE(right(sightings, there, 1.0), 0.95 * static_cast<double>(sightings.size()));
  for (const Sighting& s : sightings) EXPECT_TRUE(is_mono(s.pixel));
}

TEST_F(Matching, SearchDoesNotLookBeyondTheRadius) {
  const SE3 there = moved(20);
  const auto pair = wall_.seen(there, 2);
  const auto sightings = search_around(expected(), SE3(), kCamera, pair->left, 5);
  EXPECT_EQ(right(sightings, there, 1.5), 0u);
  for (const Sighting& s : sightings) {
    // Whole pixels of the level, two at least; and one more, where the best of every other pixel has a better
    // neighbour.
    const double reach = std::max(2.0, std::ceil(5 / pixel_sigma(level(s)))) + 1.51;
    const Vector3 off = (s.pixel - truth(s.landmark, SE3())) / pixel_sigma(level(s));
    EXPECT_LE(std::abs(off.x()), reach);
    EXPECT_LE(std::abs(off.y()), reach);
  }
}

TEST_F(Matching, WideSearchLeavesFineLevelsOut) {
  const SE3 there = moved(20);
  const auto pair = wall_.seen(there, 2);
  const auto sightings = search_around(expected(), SE3(), kCamera, pair->left, 24);
  EXPECT_GE(right(sightings, there, 1.0), 5u);
  for (const Sighting& s : sightings) EXPECT_GE(level(s), 2);
}

TEST_F(Matching, CornersAreSearchedFarOff) {
  const SE3 there = moved(40);
  const auto pair = wall_.seen(there, 2);
  const auto corners = detector_.detect(pair->left);
  const auto sightings = search_corners(expected(), SE3(), kCamera, pair->left, corners, 60);
  EXPECT_GE(right(sightings, there, 1.5), 0.25 * static_cast<double>(landmarks_.size()));
  EXPECT_GE(right(sightings, there, 1.5), 0.7 * static_cast<double>(sightings.size()));
}

TEST_F(Matching, AlignsToATenthOfAPixel) {
  const SE3 there{so3_exp({0.004, -0.01, 0.03}), {0.05, -0.03, 0.25}};
  const SE3 guess = there * moved(1.5);
  const auto pair = wall_.seen(there, 2);
  std::size_t in_view = 0;
  const auto sightings = align_patches(expected(guess), guess.inverse(), kCamera, pair->left, in_view);
  EXPECT_GE(static_cast<double>(sightings.size()), 0.9 * static_cast<double>(in_view));
  EXPECT_GE(in_view, 60u);
  ASSERT_FALSE(sightings.empty());
  std::size_t good = 0;
  double squares = 0;
  for (const Sighting& s : sightings) {
    const double off = error(s, there);
    EXPECT_TRUE(is_mono(s.pixel));
    if (off > 0.5) continue;
    ++good;
    squares += off * off / 2;  // a coordinate
  }
  EXPECT_GE(static_cast<double>(good), 0.97 * static_cast<double>(sightings.size()));
  EXPECT_LE(std::sqrt(squares / static_cast<double>(good)), 0.1);
}

TEST_F(Matching, SubtractsTheOffsetFromDisparities) {
  const SE3 there{Matrix3::Identity(), {0.03, 0, 0.1}};
  const auto pair = wall_.seen(there, 2, 0.6);
  std::size_t in_view = 0;
  const auto left = align_patches(expected(there), there.inverse(), kCamera, pair->left, in_view);
  for (const double known : {0.6, 0.0}) {
    auto sightings = left;
    match_right(landmarks_.all(), there.inverse(), kCamera, known, pair->left, pair->right, sightings);
    double sum = 0, squares = 0;
    std::size_t stereo = 0;
    for (const Sighting& s : sightings) {
      if (is_mono(s.pixel) || level(s) > 0) continue;
      const StereoPixel seen = truth(s.landmark, there);
      const double off = (s.pixel.x() - s.pixel.z()) - (seen.x() - seen.z());
      sum += off;
      squares += std::pow(off - (0.6 - known), 2);
      ++stereo;
    }
    ASSERT_GE(stereo, 30u);
    EXPECT_NEAR(sum / static_cast<double>(stereo), 0.6 - known, 0.03);
    EXPECT_LE(std::sqrt(squares / static_cast<double>(stereo)), 0.1);
  }
}

TEST_F(Matching, ExpectsOnlyWhatThePoseShows) {
  EXPECT_EQ(expected().patches().size(), landmarks_.size());
  const SE3 turned{so3_exp({0, 0.5, 0}), Vector3::Zero()};  // half the picture
  const std::size_t some = expected(turned).patches().size();
  EXPECT_GT(some, 10u);
  EXPECT_LT(static_cast<double>(some), 0.7 * static_cast<double>(landmarks_.size()));
  EXPECT_TRUE(expected({so3_exp({0, 3, 0}), Vector3::Zero()}).patches().empty());
  EXPECT_TRUE(expected({Matrix3::Identity(), {0, 0, 4}}).patches().empty());  // the wall is behind
}

}  // namespace
}  // namespace relmap::tracking
