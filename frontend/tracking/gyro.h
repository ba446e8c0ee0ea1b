// Measures the rotation of the camera by a gyro, and estimates the gyro's bias while vision measures the rotation.
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
  // `R_frame_camera` rotates from the raw left camera's axes to those of frames (Rectifier::left_rotation()).
  explicit Gyro(const ImuCalibration& calibration, const Matrix3& R_frame_camera = Matrix3::Identity());

  // Samples must have rising times, later than those before; others are ignored.
  void add(std::span<const ImuSample> samples);
  void forget_before(std::int64_t time_us);

  struct Turn {
    Matrix3 R_from_to;
    // Standard deviations about each axis: of the noise, which is independent from turn to turn, in radians, and of the
    // remaining bias, which is common to all turns, in rad/s.
    double noise = 0;
    double bias_sigma = 0;
  };
  // The rotation between two times. Nothing if samples do not cover them, or are missing for more than 50 ms.
  std::optional<Turn> turn(std::int64_t from_us, std::int64_t to_us) const;

  // Updates the bias from the same rotation as measured by vision, with a standard deviation of `sigma` radians.
  void correct(std::int64_t from_us, std::int64_t to_us, const Matrix3& R_from_to, double sigma);

  const Vector3& bias() const { return bias_; }  // rad/s, in the unit's axes
  double bias_sigma() const;                     // rad/s

 private:
  struct Rate {
    std::int64_t time_us;
    Vector3 rate;  // rad/s, in the axes of frames, bias included
  };
  Vector3 rate_at(std::int64_t time_us, std::size_t after) const;

  ImuCalibration calibration_;
  Matrix3 R_frame_imu_;
  std::deque<Rate> rates_;
  Vector3 bias_ = Vector3::Zero();
  double bias_variance_;
};

}  // namespace relmap::tracking
