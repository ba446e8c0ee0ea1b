#include "frontend/vision/three_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

namespace relmap::vision {
namespace {

struct Sample {
  SE3 T_camera_reference;
  std::array<Vector3, 3> points, rays;
};

// Points 1 to 50 m in front of a camera that is anywhere.
Sample draw(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Sample sample;
  Vector6 xi;
  for (int k = 0; k < 6; ++k) xi[k] = 3 * unit(random);
  sample.T_camera_reference = SE3::exp(xi);
  for (std::size_t k = 0; k < 3; ++k) {
    const double depth = std::pow(50, 0.5 + 0.5 * unit(random));
    sample.rays[k] = Vector3(unit(random), unit(random), 1);
    sample.points[k] = sample.T_camera_reference.inverse() * (depth * sample.rays[k]);
  }
  return sample;
}

double error(const SE3& x, const SE3& y) { return (x.inverse() * y).log().norm(); }

double distance_to(const ThreePointPoses& poses, const SE3& truth) {
  double nearest = 1e9;
  for (const SE3& pose : poses) nearest = std::min(nearest, error(pose, truth));
  return nearest;
}

TEST(ThreePoint, EachPoseShowsThePointsAlongTheirRaysAndOneIsTrue) {
  std::mt19937_64 random(1);
  int missed = 0, poses_found = 0;
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    const Sample sample = draw(random);
    const ThreePointPoses poses = three_point_poses(sample.points, sample.rays);
    poses_found += static_cast<int>(poses.count);
    for (const SE3& pose : poses) {
      EXPECT_LT((pose.R * pose.R.transpose() - Matrix3::Identity()).norm(), 1e-5);
      EXPECT_GT(pose.R.determinant(), 0);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3 p = pose * sample.points[k];
        EXPECT_LT((p / p.z() - sample.rays[k]).norm(), 1e-6);
        EXPECT_GT(p.z(), 0);
      }
    }
    missed += distance_to(poses, sample.T_camera_reference) > 1e-4;
  }
  EXPECT_EQ(missed, 0);
  EXPECT_GT(poses_found, kSamples * 5 / 4) << "a sample may have several poses";
}

// What another solution of the problem finds is found here, too.
TEST(ThreePoint, FindsThePosesOfOpenCv) {
  std::mt19937_64 random(2);
  int theirs = 0, missed = 0;
  for (int i = 0; i < 500; ++i) {
    const Sample sample = draw(random);
    std::vector<cv::Point3d> points;
    std::vector<cv::Point2d> rays;
    for (std::size_t k = 0; k < 3; ++k) {
      points.emplace_back(sample.points[k].x(), sample.points[k].y(), sample.points[k].z());
      rays.emplace_back(sample.rays[k].x(), sample.rays[k].y());
    }
    std::vector<cv::Mat> rotations, translations;
    cv::solveP3P(points, rays, cv::Matx33d::eye(), cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
    const ThreePointPoses poses = three_point_poses(sample.points, sample.rays);
    for (std::size_t k = 0; k < rotations.size(); ++k) {
      const cv::Mat &r = rotations[k], &t = translations[k];
      const SE3 pose{so3_exp({r.at<double>(0), r.at<double>(1), r.at<double>(2)}),
                     {t.at<double>(0), t.at<double>(1), t.at<double>(2)}};
      const bool solves = std::ranges::all_of(std::array<std::size_t, 3>{0, 1, 2}, [&](std::size_t p) {
        const Vector3 q = pose * sample.points[p];
        return q.z() > 0 && (q / q.z() - sample.rays[p]).norm() < 1e-7;
      });
      if (!solves) continue;
      ++theirs;
      missed += distance_to(poses, pose) > 1e-4;
    }
  }
  EXPECT_GT(theirs, 700);
  EXPECT_EQ(missed, 0);
}

TEST(ThreePoint, DegenerateSamplesHaveNoPoseOrOneThatIsARotation) {
  const std::array<Vector3, 3> line{Vector3(0, 0, 4), Vector3(1, 0, 5), Vector3(2, 0, 6)};
  const std::array<Vector3, 3> rays{Vector3(0, 0, 1), Vector3(0.2, 0, 1), Vector3(0.3, 0, 1)};
  EXPECT_EQ(three_point_poses(line, rays).count, 0u);
  const std::array<Vector3, 3> one_point{Vector3(1, 2, 3), Vector3(1, 2, 3), Vector3(2, 0, 6)};
  EXPECT_EQ(three_point_poses(one_point, rays).count, 0u);
  std::array<Vector3, 3> nearly_one = one_point;  // two views of one landmark
  nearly_one[1].x() += 1e-15;
  for (const SE3& pose : three_point_poses(nearly_one, rays))
    EXPECT_LT((pose.R * pose.R.transpose() - Matrix3::Identity()).norm(), 1e-4);
  const std::array<Vector3, 3> triangle{Vector3(0, 0, 4), Vector3(1, 0, 5), Vector3(0, 1, 6)};
  const std::array<Vector3, 3> one_ray{rays[1], rays[1], rays[1]};
  for (const SE3& pose : three_point_poses(triangle, one_ray))
    EXPECT_LT((pose.R * pose.R.transpose() - Matrix3::Identity()).norm(), 1e-4);
  const Vector3 nothing = Vector3::Constant(std::nan(""));
  EXPECT_EQ(three_point_poses({nothing, nothing, nothing}, rays).count, 0u);
}

}  // namespace
}  // namespace relmap::vision
