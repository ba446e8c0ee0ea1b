// Parses kalibr's camchain: cam0, cam1, ..., each with the transform from the camera before it.
#include "proto/calibration/calibration_yaml.h"

namespace relmap {

namespace {

using namespace calibration_yaml;

RawCamera read_kalibr_camera(const YAML::Node& node, const char* what) {
  const std::string camera = node["camera_model"].as<std::string>(""),
                    lens = node["distortion_model"].as<std::string>("");
  if (camera != "pinhole") fail(Reason::UNSUPPORTED, what, ": camera model '", camera, "'; known: pinhole");
  if (lens != "radtan" && lens != "none")
    fail(Reason::UNSUPPORTED, what, ": distortion model '", lens, "'; known: radtan, none");
  const std::vector<double> f = numbers(node["intrinsics"], "intrinsics", 4, 4);
  RawCamera c{f[0], f[1], f[2], f[3]};
  if (lens == "radtan") set_distortion(c, numbers(node["distortion_coeffs"], "distortion_coeffs", 4, 4), what);
  return c;
}

StereoCalibration read_kalibr(std::string_view text) {
  const YAML::Node root = load(text);
  const YAML::Node left = root["cam0"], right = root["cam1"];
  if (!left.IsDefined() || !left.IsMap()) fail(Reason::CORRUPT, "no cam0 in a camchain of kalibr");
  StereoCalibration c;
  c.left = read_kalibr_camera(left, "cam0");
  set_size(c, numbers(left["resolution"], "resolution", 2, 2));
  if (left["T_cam_imu"].IsDefined()) c.T_body_left = rigid(left["T_cam_imu"], "T_cam_imu").inverse();
  if (!right.IsDefined()) return c;
  c.right = read_kalibr_camera(right, "cam1");
  c.T_right_left = rigid(right["T_cn_cnm1"], "T_cn_cnm1");
  if (numbers(left["resolution"], "resolution", 2, 2) != numbers(right["resolution"], "resolution", 2, 2))
    fail(Reason::IMPLAUSIBLE_CALIBRATION, "the two cameras' pictures differ in size");
  return c;
}

}  // namespace

Result<StereoCalibration> parse_kalibr_calibration(std::string_view text) {
  return guarded([&] { return plausible(read_kalibr(text)); });
}

}  // namespace relmap
