// Parses EuRoC's sensor.yaml of cameras and of inertial units. T_BS: sensor to body.
#include <cmath>

#include "proto/calibration/calibration_yaml.h"
#include "proto/calibration/imu_calibration.h"

namespace relmap {

namespace {

using namespace calibration_yaml;

RawCamera read_euroc_camera(const YAML::Node& root, SE3& T_BS) {
  const std::string camera = root["camera_model"].as<std::string>(""),
                    lens = root["distortion_model"].as<std::string>("");
  if (camera != "pinhole") fail(Reason::UNSUPPORTED, "camera model '", camera, "'; known: pinhole");
  if (lens != "radial-tangential" && lens != "radtan" && lens != "plumb_bob")
    fail(Reason::UNSUPPORTED, "distortion model '", lens, "'; known: radial-tangential");
  const std::vector<double> f = numbers(root["intrinsics"], "intrinsics", 4, 4);
  RawCamera c{f[0], f[1], f[2], f[3]};
  set_distortion(c, numbers(root["distortion_coefficients"], "distortion_coefficients", 4, 8), "distortion");
  T_BS = rigid(root["T_BS"], "T_BS");
  return c;
}

StereoCalibration read_euroc_left(const YAML::Node& root) {
  StereoCalibration c;
  c.left = read_euroc_camera(root, c.T_body_left);
  set_size(c, numbers(root["resolution"], "resolution", 2, 2));
  return c;
}

StereoCalibration read_euroc(std::string_view cam0, std::string_view cam1) {
  const YAML::Node left = load(cam0), right = load(cam1);
  StereoCalibration c = read_euroc_left(left);
  SE3 T_body_right;
  c.right = read_euroc_camera(right, T_body_right);
  c.T_right_left = T_body_right.inverse() * c.T_body_left;
  if (numbers(left["resolution"], "resolution", 2, 2) != numbers(right["resolution"], "resolution", 2, 2))
    fail(Reason::IMPLAUSIBLE_CALIBRATION, "the two cameras' pictures differ in size");
  return c;
}

ImuSensor read_imu(std::string_view text) {
  const YAML::Node root = load(text);
  const auto number = [&](const char* name) {
    const YAML::Node node = root[name];
    if (!node.IsDefined()) fail(Reason::CORRUPT, "no ", name, " in the calibration of an inertial unit");
    return node.as<double>();
  };
  ImuSensor sensor;
  sensor.T_body_imu = rigid(root["T_BS"], "T_BS");
  sensor.gyro_noise = number("gyroscope_noise_density");
  sensor.gyro_walk = number("gyroscope_random_walk");
  if (root["timeshift_cam_imu"].IsDefined()) sensor.time_shift_s = number("timeshift_cam_imu");
  if (!(sensor.gyro_noise > 0 && sensor.gyro_noise <= 1 && sensor.gyro_walk >= 0 && sensor.gyro_walk <= 1))
    fail(Reason::IMPLAUSIBLE_CALIBRATION, "gyroscope noise ", sensor.gyro_noise,
         " must be above 0 and at most 1, walk ", sensor.gyro_walk, " must be 0..1");
  if (!(std::abs(sensor.time_shift_s) <= kMaxTimeShiftS))
    fail(Reason::IMPLAUSIBLE_CALIBRATION, "clocks ", sensor.time_shift_s, " s apart; at most ", kMaxTimeShiftS);
  return sensor;
}

}  // namespace

Result<StereoCalibration> parse_euroc_calibration(std::string_view cam0, std::string_view cam1) {
  return guarded([&] { return plausible(read_euroc(cam0, cam1)); });
}

Result<StereoCalibration> parse_euroc_calibration(std::string_view cam0) {
  return guarded([&] { return plausible(read_euroc_left(load(cam0))); });
}

Result<ImuSensor> parse_imu_calibration(std::string_view text) {
  return guarded([&] { return read_imu(text); });
}

}  // namespace relmap
