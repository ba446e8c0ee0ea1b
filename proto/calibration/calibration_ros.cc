// Parses ROS camera_info, one file for each eye. K and D describe the raw picture, R rectifies it, and
// P = [f 0 cx Tx; 0 f cy Ty; 0 0 1 0] is of the rectified picture, with Tx = -f B for the right eye.
#include "proto/calibration/calibration_yaml.h"

namespace relmap {

namespace {

using namespace calibration_yaml;

struct Eye {
  RawCamera raw;
  Matrix3 R;                   // p_rectified = R p_raw
  RawCamera rectified;         // from P
  Vector3 from_left{0, 0, 0};  // p_rectified = p_rectified_left + from_left, metres
  std::vector<double> size;
};

Eye read_eye(std::string_view text, const char* what) {
  const YAML::Node root = load(text);
  const std::string lens = root["distortion_model"].as<std::string>("plumb_bob");
  // The rational polynomial is plumb_bob if its other coefficients are 0, which set_distortion() checks.
  if (lens != "plumb_bob" && lens != "rational_polynomial")
    fail(Reason::UNSUPPORTED, what, ": distortion model '", lens, "'; known: plumb_bob");
  Eye eye;
  eye.raw = opencv_camera(root["camera_matrix"], root["distortion_coefficients"], what);
  eye.size = {root["image_width"].as<double>(), root["image_height"].as<double>()};
  eye.R =
      rigid(numbers(root["rectification_matrix"], "rectification_matrix", 9, 9), {0, 0, 0}, "rectification_matrix").R;
  const std::vector<double> p = numbers(root["projection_matrix"], "projection_matrix", 12, 12);
  if (p[1] != 0 || p[4] != 0 || p[8] != 0 || p[9] != 0 || p[10] != 1)
    fail(Reason::CORRUPT, what, ": projection_matrix is no rectified projection");
  if (!(p[0] > 0 && p[5] > 0))
    fail(Reason::IMPLAUSIBLE_CALIBRATION, what, ": focal lengths ", p[0], " and ", p[5],
         " px in projection_matrix; must be positive");
  eye.rectified = {p[0], p[5], p[2], p[6]};
  eye.from_left = {p[3] / p[0], p[7] / p[5], 0};
  return eye;
}

// True if rectification would change nothing.
bool is_rectified(const Eye& eye) {
  return eye.raw == eye.rectified && eye.raw.fx == eye.raw.fy && eye.R.isIdentity(1e-9);
}

StereoCalibration read_ros_left(std::string_view text) {
  const Eye eye = read_eye(text, "the camera");
  StereoCalibration c;
  c.left = eye.raw;
  set_size(c, eye.size);
  return c;
}

StereoCalibration read_ros(std::string_view left_text, std::string_view right_text) {
  const Eye left = read_eye(left_text, "the left camera"), right = read_eye(right_text, "the right camera");
  if (left.size != right.size) fail(Reason::IMPLAUSIBLE_CALIBRATION, "the two cameras' pictures differ in size");
  StereoCalibration c;
  c.left = left.raw;
  c.right = right.raw;
  c.T_right_left = {right.R.transpose() * left.R, right.R.transpose() * (right.from_left - left.from_left)};
  c.rectified = is_rectified(left) && is_rectified(right) && left.raw == right.raw;
  set_size(c, left.size);
  return c;
}

}  // namespace

Result<StereoCalibration> parse_ros_calibration(std::string_view left, std::string_view right) {
  return guarded([&] { return plausible(read_ros(left, right)); });
}

Result<StereoCalibration> parse_ros_calibration(std::string_view camera) {
  return guarded([&] { return plausible(read_ros_left(camera)); });
}

}  // namespace relmap
