#include "proto/geometry/canonical_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relmap {
namespace {

TEST(CanonicalQuaternion, SurvivesTheWayThroughTheMatrix) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> angle(-3.2, 3.2);
  for (int i = 0; i < 20000; ++i) {
    const Matrix3 R = so3_exp({angle(random), angle(random), angle(random)});
    const QuaternionWxyz q = canonical_quaternion(R);
    ASSERT_LT((rotation_of(q) - R).cwiseAbs().maxCoeff(), 1e-13);
    ASSERT_EQ(canonical_quaternion(rotation_of(q)), q);
  }
}

TEST(CanonicalQuaternion, SurvivesRotationsWhoseComponentsTie) {
  const double half = std::sqrt(0.5);
  for (const double w : {0., 0.5, -0.5, half, 1., 1e-15})
    for (const double x : {0., 0.5, -0.5, half, -half, 1.})
      for (const double y : {0., 0.5, -0.5, half, -half, -1.})
        for (const double z : {0., 0.5, -0.5, half, -half, 1.}) {
          const Eigen::Quaterniond e(w, x, y, z);
          if (std::abs(e.norm() - 1) > 1e-9) continue;
          const QuaternionWxyz q = canonical_quaternion(e.toRotationMatrix());
          EXPECT_EQ(canonical_quaternion(rotation_of(q)), q);
          EXPECT_LT(e.angularDistance(Eigen::Quaterniond(q[0], q[1], q[2], q[3])), 1e-7);
          EXPECT_FALSE(std::signbit(q[0]));
        }
}

}  // namespace
}  // namespace relmap
