#include "tools/sim/motion_blur.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/sim/street_scene.h"

namespace relmap::sim {
namespace {

class MotionBlur : public testing::Test {
 protected:
  static constexpr double kExposure = 0.04;

  MovingEye eye_with(const Vector3& velocity, const Vector3& angular_velocity) const {
    MovingEye eye{{}, velocity, angular_velocity};
    eye.T_world_eye.t = Vector3(circuit_.point(5).x(), -1, circuit_.point(5).y());
    return eye;
  }
  std::vector<float> sharp(const SE3& T) const {
    return shade(snapshot_, camera_, T, find_visible(snapshot_, camera_, T, kSamplesPerSide));
  }
  // As it is: the mean of many instants.
  std::vector<float> slow_truth(const MovingEye& eye) const {
    const int instants = 60;
    std::vector<float> sum;
    for (int k = 0; k < instants; ++k) {
      const double t = kExposure * ((k + 0.5) / instants - 0.5);
      const SE3 motion{so3_exp(eye.angular_velocity * t), eye.velocity * t};
      const std::vector<float> light = sharp(eye.T_world_eye * motion);
      sum.resize(light.size());
      for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += light[p] / instants;
    }
    return sum;
  }
  static double difference(const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0;
    for (std::size_t p = 0; p < a.size(); ++p) sum += std::abs(a[p] - b[p]);
    return sum / static_cast<double>(a.size());
  }

  const StereoCamera camera_{.f = 200, .cx = 127.5, .cy = 95.5, .baseline = 0.2, .width = 256, .height = 192};
  const Circuit circuit_{1, 30};
  const Scene scene_ = build_street(circuit_, 1);
  const Snapshot snapshot_{scene_, {}};
};

TEST_F(MotionBlur, OfARotationIsTheMeanOfManySharpPictures) {
  for (const Vector3& turn : {Vector3(0, 1.5, 0), Vector3(0.8, -0.5, 1.0)}) {
    const MovingEye eye = eye_with(Vector3::Zero(), turn);
    const std::vector<float> mean = slow_truth(eye);
    const double error = difference(shade_blurred(snapshot_, camera_, eye, kExposure), mean);
    EXPECT_LT(error, 1.6);  // what interpolation between pixels costs
    EXPECT_GT(difference(sharp(eye.T_world_eye), mean), 6 * error);
  }
}

TEST_F(MotionBlur, OfATranslationIsThatMeanExceptAtOcclusions) {
  const MovingEye eye = eye_with(Vector3(0.3, 0, 2.0), Vector3::Zero());
  const std::vector<float> mean = slow_truth(eye);
  const double error = difference(shade_blurred(snapshot_, camera_, eye, kExposure), mean);
  EXPECT_LT(error, 2);
  EXPECT_GT(difference(sharp(eye.T_world_eye), mean), 2 * error);
}

TEST_F(MotionBlur, AnEyeAtRestSeesSharply) {
  const MovingEye eye = eye_with(Vector3::Zero(), Vector3::Zero());
  EXPECT_LT(difference(shade_blurred(snapshot_, camera_, eye, kExposure), sharp(eye.T_world_eye)), 1e-3);
}

}  // namespace
}  // namespace relmap::sim
