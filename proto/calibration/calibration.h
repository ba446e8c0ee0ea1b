// Calibrations of stereo rigs, and parsers of the formats of data sets and calibration tools: KITTI, OpenCV, EuRoC,
// kalibr, ROS.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "proto/base/status.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap {

// A pinhole camera with radial-tangential distortion (Brown; OpenCV's k1, k2, p1, p2, k3), before rectification:
// x = X/Z, y = Y/Z, r2 = x^2 + y^2, g = 1 + k1 r2 + k2 r2^2 + k3 r2^3,
// u = fx (g x + 2 p1 x y + p2 (r2 + 2 x^2)) + cx,  v = fy (g y + p1 (r2 + 2 y^2) + 2 p2 x y) + cy.
struct RawCamera {
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  bool operator==(const RawCamera&) const = default;
};

struct StereoCalibration {
  RawCamera left, right;
  SE3 T_right_left;           // p_right = T_right_left p_left; metres
  int width = 0, height = 0;  // pixels, of both pictures; 0: the file does not say (KITTI's calib.txt)
  bool rectified = false;     // the pictures are rectified already; only then rectified_camera() describes them
  SE3 T_body_left;            // p_body = T_body_left p_left, metres; identity where the format names no body

  bool operator==(const StereoCalibration&) const = default;

  bool mono() const { return right == RawCamera{}; }  // one camera only

  // The calibration of the right eye as a mono camera, which is then the left one of the result.
  StereoCalibration right_eye() const;

  // The camera of pictures that are rectified already (`rectified`). Its size is 0 where width and height are.
  StereoCamera rectified_camera() const;

  // IMPLAUSIBLE_CALIBRATION, with what is wrong: numbers that are not finite; sizes, focal lengths or principal points
  // that StereoCamera::check_plausible() refuses; fx and fy more than 10 % apart; tangential distortion above 0.1;
  // distortion that folds the picture over itself before its edges; a baseline that is not 5 mm .. 10 m long, or does
  // not lead mostly along x to the right; eyes turned by more than 20 degrees against each other; `rectified` although
  // the eyes are distorted or differ. With width 0, the checks that need the size are left out.
  Status check_plausible() const;
};

// Parsers of a whole file's text. CORRUPT: the text is not of that format; IMPLAUSIBLE_CALIBRATION: check_plausible()
// refuses what was read; UNSUPPORTED: a camera or distortion model other than that of RawCamera.

// KITTI odometry's calib.txt (P0, P1: grey cameras) or KITTI raw's calib_cam_to_cam.txt (P_rect_00, P_rect_01,
// S_rect_00). Always rectified.
Result<StereoCalibration> parse_kitti_calibration(std::string_view text);

// OpenCV's FileStorage YAML ("%YAML:1.0", !!opencv-matrix) with M1, D1, M2, D2, R, T as stereoCalibrate() gives them
// (or K1, K2; cameraMatrix1, distCoeffs1, ...), and the size as imageSize, image_size, size or image_width and
// image_height. T in metres.
Result<StereoCalibration> parse_opencv_calibration(std::string_view text);

// EuRoC's cam0/sensor.yaml and cam1/sensor.yaml (T_BS: sensor to body). cam0 alone gives a mono camera.
Result<StereoCalibration> parse_euroc_calibration(std::string_view cam0, std::string_view cam1);
Result<StereoCalibration> parse_euroc_calibration(std::string_view cam0);

// kalibr's camchain: cam0 and cam1 (cam0 alone gives a mono camera), pinhole with radtan or no distortion. If there is
// a T_cam_imu, as in kalibr's camchain-imucam, the inertial unit is the body.
Result<StereoCalibration> parse_kalibr_calibration(std::string_view text);

// ROS camera_info of the left and of the right camera (plumb_bob). The baseline comes from the right camera's
// projection_matrix, the rotation between the eyes from both rectification_matrix. `rectified` is set if rectification
// would change nothing. One file alone gives a mono camera.
Result<StereoCalibration> parse_ros_calibration(std::string_view left, std::string_view right);
Result<StereoCalibration> parse_ros_calibration(std::string_view camera);

// Loads a calibration from `path`. A file may be of any of the formats above; its content tells which. A folder is
// searched for calib.txt, calib_cam_to_cam.txt, cam0/sensor.yaml, mav0/cam0/sensor.yaml, cam0_sensor.yaml, stereo.yaml
// and calibration.yaml (or .yml), and then for the only .yaml or .yml that holds a calibration. EuRoC (cam0, cam1) and
// ROS (left.yaml and right.yaml, X_left.yaml and X_right.yaml) have two files: naming either of them loads both; if
// there is no right one, the result is a mono camera. NO_SUCH_FILE; INVALID_ARGUMENT: several calibrations in a folder;
// or as above, with the path.
Result<StereoCalibration> load_calibration(const std::string& path);

}  // namespace relmap
