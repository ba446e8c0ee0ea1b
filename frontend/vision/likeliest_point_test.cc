#include "frontend/vision/likeliest_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "proto/geometry/covariance.h"

namespace relmap::vision {
namespace {

const StereoCamera kStereoCamera{450, 320, 240, 0.4, 640, 480};

// The covariance of a point that was triangulated, with a sigma of one pixel in each coordinate.
Matrix3 triangulated_covariance(const Vector3& p) {
  Matrix3 H = kStereoCamera.jacobian(p);
  return (H.transpose() * H).inverse();
}

// A place on a street, seen again from the other lane and from `back` metres before: points beside the street, 6 to 60
// m away, that were triangulated from the place. All coordinates have a noise of one pixel.
class Street {
 public:
  Street(unsigned seed, double back) : random_(seed) {
    T_place_camera = SE3::exp((Vector6() << 0, 0, 0, 0.02, -0.05, 0.01).finished());
    T_place_camera.t = {-3.5, 0.05, -back};
    std::uniform_real_distribution<double> across(4, 9), down(-4, 1.5), ahead(6, 60);
    std::bernoulli_distribution left;
    while (all.size() < 60) {
      const Vector3 at(left(random_) ? -across(random_) : across(random_), down(random_), ahead(random_));
      const StereoPixel from_place = measured(at), seen = measured(T_place_camera.inverse() * at);
      if (!in_picture(from_place) || !in_picture(seen) || from_place.x() - from_place.z() < 2) continue;
      const Vector3 point = kStereoCamera.triangulate(from_place);
      all.push_back({point, seen, 1, triangulated_covariance(point)});
    }
  }

  SE3 T_place_camera;
  std::vector<Correspondence> all;

 private:
  StereoPixel measured(const Vector3& p) {
    std::normal_distribution<double> noise;
    if (!(p.z() > 1)) return StereoPixel::Constant(-1e3);
    return kStereoCamera.project(p) + Vector3(noise(random_), noise(random_), noise(random_));
  }
  static bool in_picture(const StereoPixel& z) {
    return kStereoCamera.in_picture(z.x(), z.y()) && kStereoCamera.in_picture(z.z(), z.y()) && z.x() > z.z();
  }
  std::mt19937_64 random_;
};

// As if points were only where they were triangulated, these cameras come out 0.25 m and more too near to each other,
// with a chi-square of 8 and more (median).
TEST(LikeliestPoint, APoseFarFromAPlaceIsNotDrawnToItAndHasTheCovarianceItSays) {
  for (const double back : {0.5, 3.0, 8.0, 12.0}) {
    constexpr int kStreets = 120;
    std::vector<double> chi2;
    double nearer = 0;
    for (unsigned seed = 1; seed <= kStreets; ++seed) {
      const Street street(seed, back);
      MotionOptions options;
      options.correct_points = true;
      const auto motion = estimate_motion(street.all, kStereoCamera, options);
      ASSERT_TRUE(motion.ok()) << motion.status().to_string();
      const SE3& T = motion->T_reference_camera;
      nearer += (street.T_place_camera.t - T.t).dot(street.T_place_camera.t.normalized()) / kStreets;
      chi2.push_back(mahalanobis_squared((T.inverse() * street.T_place_camera).log(), motion->covariance));
    }
    std::nth_element(chi2.begin(), chi2.begin() + kStreets / 2, chi2.end());
    EXPECT_LT(std::abs(nearer), 0.15) << back << " m back";
    EXPECT_GT(chi2[kStreets / 2], 3.5) << back << " m back";  // 5.3 for six degrees of freedom
    EXPECT_LT(chi2[kStreets / 2], 7.5) << back << " m back";
  }
}

TEST(LikeliestPoint, IsBetweenWhereTheTwoViewsHaveIt) {
  const Vector3 measured(1, 0.5, 30), true_point = measured * 1.2;
  SE3 T_camera_reference;
  T_camera_reference.t = {3.5, 0, 0};
  const Correspondence c{measured, kStereoCamera.project(T_camera_reference * true_point), 1,
                         triangulated_covariance(measured)};
  ASSERT_FALSE(is_well_known(c));
  const Correspondence moved = at_likeliest_point(c, kStereoCamera, T_camera_reference);
  EXPECT_GT(moved.point.z(), measured.z());
  EXPECT_LT(moved.point.z(), true_point.z());
  // It is about along the ray; and the farther, the less is its depth known.
  EXPECT_LT((kStereoCamera.project(moved.point) - kStereoCamera.project(measured)).head<2>().norm(), 1);
  EXPECT_GT(moved.point_covariance(2, 2), c.point_covariance(2, 2));
  const auto squares = [&](const Correspondence& at) {
    const Vector3 p = T_camera_reference * at.point;
    const Matrix3 HR = kStereoCamera.jacobian(p) * T_camera_reference.R;
    const Matrix3 S = HR * at.point_covariance * HR.transpose() + Matrix3::Identity();
    return mahalanobis_squared(Vector3(at.pixel - kStereoCamera.project(p)), S);
  };
  // The difference from the projection tells the same, to first order, with the covariance of the new point.
  Correspondence near = c;
  near.pixel = kStereoCamera.project(T_camera_reference * (measured * 1.01));
  EXPECT_NEAR(squares(at_likeliest_point(near, kStereoCamera, T_camera_reference)), squares(near),
              0.05 * squares(near));
}

TEST(LikeliestPoint, StaysWhereBothViewsAgreeAndIfItCannotBeSeen) {
  const Vector3 point(-2, 1, 25);
  SE3 T_camera_reference;
  T_camera_reference.t = {-3, 0.2, 4};
  Correspondence c{point, kStereoCamera.project(T_camera_reference * point), 1, triangulated_covariance(point)};
  const Correspondence agreed = at_likeliest_point(c, kStereoCamera, T_camera_reference);
  EXPECT_LT((agreed.point - point).norm(), 1e-9);
  EXPECT_LT((agreed.pixel - c.pixel).norm(), 1e-9);
  c.pixel.z() = kNoRight;
  const Correspondence mono = at_likeliest_point(c, kStereoCamera, T_camera_reference);
  EXPECT_LT((mono.point - point).norm(), 1e-9);
  EXPECT_TRUE(is_mono(mono.pixel));
  T_camera_reference.t.z() = -30;
  EXPECT_EQ(at_likeliest_point(c, kStereoCamera, T_camera_reference).point, point);
}

TEST(LikeliestPoint, AnExactPointIsWellKnown) {
  EXPECT_TRUE(is_well_known({Vector3(0, 0, 10), StereoPixel(320, 240, 300)}));
  EXPECT_TRUE(is_well_known({Vector3::Zero(), StereoPixel(320, 240, 300)}));
  const Vector3 near(0.5, 0.2, 2);
  EXPECT_TRUE(is_well_known({near, kStereoCamera.project(near), 1, triangulated_covariance(near)}));
}

}  // namespace
}  // namespace relmap::vision
