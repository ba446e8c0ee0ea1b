// A raw stereo calibration for tests.
#pragma once

#include "proto/calibration/calibration.h"

namespace relmap {

// Has a baseline of 0.12 m, and distortion and rotation in every parameter. Its pictures are 160 x 120 times `scale`.
inline StereoCalibration sample_raw_calibration(int scale = 1) {
  StereoCalibration calibration;
  calibration.width = 160 * scale;
  calibration.height = 120 * scale;
  calibration.left = {100.0, 101.0, 79.25, 59.5, -0.3, 0.1, 1e-4, -2e-4, 0.01};
  calibration.right = {102.0, 100.0, 78.5, 60.5, -0.31, 0.11, -1e-4, 1e-4, -0.02};
  for (RawCamera* eye : {&calibration.left, &calibration.right})
    for (double* pixels : {&eye->fx, &eye->fy, &eye->cx, &eye->cy}) *pixels *= scale;
  Vector6 turn;
  turn << -0.12, 1e-3, -2e-3, 0.01, -0.02, 0.005;
  calibration.T_right_left = SE3::exp(turn);
  return calibration;
}

}  // namespace relmap
