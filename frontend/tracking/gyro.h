// Rotation of the camera by a gyro, whose bias is estimated while vision tells the rotation better.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "proto/calibration/imu.h"
#include "proto/geometry/geometry.h"

namespace relmap::tracking {

class Gyro {
 public:
  // `R_frame_camera`: from the raw left camera's axes to those of the frames (Rectifier::left_rotation()).
  explicit Gyro(const ImuCalibration& calibration, const Matrix3& R_frame_camera = Matrix3::Identity());

  // By rising time, later than those before; others are left out.
  void add(std::span<const ImuSample> samples);
  void forget_before(std::int64_t time_us);

  struct Turn {
    Matrix3 R_from_to;
    double noise = 0;       // radians, of each axis: standard deviation of what is independent from turn to turn
    double bias_sigma = 0;  // rad/s, likewise, of what is not known of the bias and stays
  };
  // Nothing where samples are missing for more than 50 ms.
  std::optional<Turn> turn(std::int64_t from_us, std::int64_t to_us) const;

  // What vision says of the same turn, good to `sigma` radians.
  void correct(std::int64_t from_us, std::int64_t to_us, const Matrix3& R_from_to, double sigma);

  const Vector3& bias() const { return bias_; }  // rad/s, in the unit's axes
  double bias_sigma() const;                     // rad/s

 private:
  struct Rate {
    std::int64_t time_us;
    Vector3 rate;  // rad/s, in the frames' axes, bias included
  };
  Vector3 rate_at(std::int64_t time_us, std::size_t after) const;

  ImuCalibration calibration_;
  Matrix3 R_frame_imu_;
  std::deque<Rate> rates_;
  Vector3 bias_ = Vector3::Zero();
  double bias_variance_;
};

}  // namespace relmap::tracking
