#include <yaml-cpp/yaml.h>

#include <cmath>
#include <initializer_list>
#include <vector>

#include "proto/calibration.h"
#include "proto/calibration_text.h"
#include "proto/imu_calibration.h"

namespace relmap {

namespace {

// Thrown inside this file only.
struct Unreadable {
  Status status;
};

template <typename... Parts>
[[noreturn]] void fail(Reason reason, const Parts&... parts) {
  throw Unreadable{refuse_calibration(reason, parts...)};
}

YAML::Node load(std::string_view text) {
  if (text.size() > kMaxCalibrationBytes) fail(Reason::CORRUPT, "too long for a calibration");
  // "%YAML:1.0", as OpenCV and EuRoC write it, is no YAML directive.
  if (text.starts_with("%YAML")) text.remove_prefix(std::min(text.find('\n'), text.size()));
  YAML::Node root = YAML::Load(std::string(text));
  if (!root.IsMap()) fail(Reason::CORRUPT, "no calibration: not a map of names");
  return root;
}

YAML::Node find(const YAML::Node& root, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const YAML::Node node = root[name]; node.IsDefined()) return node;
  return YAML::Node(YAML::NodeType::Undefined);
}

std::vector<double> numbers(const YAML::Node& node, const char* what, std::size_t least, std::size_t most) {
  const YAML::Node list = node.IsMap() ? node["data"] : node;
  if (!list.IsDefined() || !list.IsSequence() || list.size() < least || list.size() > most)
    fail(Reason::CORRUPT, what, " is not a list of ", least, least == most ? "" : " or more", " numbers");
  std::vector<double> values;
  for (const YAML::Node& item : list) values.push_back(item.as<double>());
  return values;
}

void set_distortion(RawCamera& camera, const std::vector<double>& d, const char* what) {
  for (std::size_t i = 5; i < d.size(); ++i)
    if (d[i] != 0) fail(Reason::UNSUPPORTED, what, " is of another model than k1, k2, p1, p2, k3");
  const auto at = [&](std::size_t i) { return i < d.size() ? d[i] : 0.0; };
  camera.k1 = at(0), camera.k2 = at(1), camera.p1 = at(2), camera.p2 = at(3), camera.k3 = at(4);
}

SE3 rigid(const std::vector<double>& r, const Vector3& t, const char* what) {
  SE3 T;
  for (int i = 0; i < 9; ++i) T.R(i / 3, i % 3) = r[static_cast<std::size_t>(i)];
  T.t = t;
  // Calibrations carry a dozen digits or fewer; anything else is a mistake.
  if (!T.R.allFinite() || (T.R * T.R.transpose()).isIdentity(1e-4) == false || T.R.determinant() < 0)
    fail(Reason::IMPLAUSIBLE_CALIBRATION, what, " is no rotation");
  return T.normalized();
}

void set_size(StereoCalibration& calibration, const std::vector<double>& size) {
  for (const double side : size)
    if (!(side >= 16 && side <= 16384)) fail(Reason::IMPLAUSIBLE_CALIBRATION, "a picture with a side of ", side, " px");
  calibration.width = static_cast<int>(size[0]);
  calibration.height = static_cast<int>(size[1]);
}

RawCamera opencv_camera(const YAML::Node& matrix, const YAML::Node& distortion, const char* what) {
  const std::vector<double> m = numbers(matrix, what, 9, 9);
  if (m[1] != 0 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1)
    fail(Reason::CORRUPT, what, " is no camera matrix");
  RawCamera camera{m[0], m[4], m[2], m[5]};
  if (distortion.IsDefined()) set_distortion(camera, numbers(distortion, what, 4, 14), what);
  return camera;
}

StereoCalibration read_opencv(std::string_view text) {
  const YAML::Node root = load(text);
  StereoCalibration c;
  const YAML::Node left = find(root, {"M1", "K1", "cameraMatrix1", "camera_matrix"});
  if (!left.IsDefined()) fail(Reason::CORRUPT, "neither M1 nor K1 nor cameraMatrix1 in an OpenCV calibration");
  c.left = opencv_camera(left, find(root, {"D1", "distCoeffs1", "distortion_coefficients"}), "the left camera");
  const YAML::Node right = find(root, {"M2", "K2", "cameraMatrix2"});
  if (right.IsDefined()) {
    c.right = opencv_camera(right, find(root, {"D2", "distCoeffs2"}), "the right camera");
    const YAML::Node R = find(root, {"R"}), T = find(root, {"T"});
    if (!R.IsDefined() || !T.IsDefined()) fail(Reason::CORRUPT, "two cameras, but no R and T between them");
    const std::vector<double> t = numbers(T, "T", 3, 3);
    c.T_right_left = rigid(numbers(R, "R", 9, 9), {t[0], t[1], t[2]}, "R");
  }
  const YAML::Node size = find(root, {"imageSize", "image_size", "size"});
  if (size.IsDefined()) {
    set_size(c, numbers(size, "the size", 2, 2));
  } else if (const YAML::Node w = find(root, {"image_width"}), h = find(root, {"image_height"});
             w.IsDefined() && h.IsDefined()) {
    set_size(c, {w.as<double>(), h.as<double>()});
  }
  return c;
}

// EuRoC's T_BS: sensor to body.
SE3 read_body_pose(const YAML::Node& root) {
  const std::vector<double> m = numbers(root["T_BS"], "T_BS", 16, 16);
  return rigid({m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]}, "T_BS");
}

RawCamera read_euroc_camera(const YAML::Node& root, SE3& T_BS) {
  const std::string camera = root["camera_model"].as<std::string>(""),
                    lens = root["distortion_model"].as<std::string>("");
  if (camera != "pinhole") fail(Reason::UNSUPPORTED, "camera model '", camera, "'; known: pinhole");
  if (lens != "radial-tangential" && lens != "radtan" && lens != "plumb_bob")
    fail(Reason::UNSUPPORTED, "distortion model '", lens, "'; known: radial-tangential");
  const std::vector<double> f = numbers(root["intrinsics"], "intrinsics", 4, 4);
  RawCamera c{f[0], f[1], f[2], f[3]};
  set_distortion(c, numbers(root["distortion_coefficients"], "distortion_coefficients", 4, 8), "distortion");
  T_BS = read_body_pose(root);
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
  sensor.T_body_imu = read_body_pose(root);
  sensor.gyro_noise = number("gyroscope_noise_density");
  sensor.gyro_walk = number("gyroscope_random_walk");
  if (root["timeshift_cam_imu"].IsDefined()) sensor.time_shift_s = number("timeshift_cam_imu");
  if (!(sensor.gyro_noise > 0 && sensor.gyro_noise <= 1 && sensor.gyro_walk >= 0 && sensor.gyro_walk <= 1))
    fail(Reason::IMPLAUSIBLE_CALIBRATION, "noise ", sensor.gyro_noise, " and walk ", sensor.gyro_walk,
         " of the gyroscope; must be above 0 and at most 1, 0 and at most 1");
  if (!(std::abs(sensor.time_shift_s) <= kMaxTimeShiftS))
    fail(Reason::IMPLAUSIBLE_CALIBRATION, "clocks ", sensor.time_shift_s, " s apart; at most ", kMaxTimeShiftS);
  return sensor;
}

StereoCalibration believed(StereoCalibration calibration) {
  if (Status s = calibration.check_plausible(); !s.ok()) throw Unreadable{s};
  return calibration;
}

// yaml-cpp reports by exceptions; none leaves this file.
template <typename Read>
auto guarded(Read read) -> Result<decltype(read())> {
  try {
    return read();
  } catch (const Unreadable& unreadable) {
    return unreadable.status;
  } catch (const std::exception& e) {
    return {Reason::CORRUPT, std::string("no calibration: ") + e.what()};
  }
}

}  // namespace

Result<StereoCalibration> parse_opencv_calibration(std::string_view text) {
  return guarded([&] { return believed(read_opencv(text)); });
}

Result<StereoCalibration> parse_euroc_calibration(std::string_view cam0, std::string_view cam1) {
  return guarded([&] { return believed(read_euroc(cam0, cam1)); });
}

Result<StereoCalibration> parse_euroc_calibration(std::string_view cam0) {
  return guarded([&] { return believed(read_euroc_left(load(cam0))); });
}

Result<ImuSensor> parse_imu_calibration(std::string_view text) {
  return guarded([&] { return read_imu(text); });
}

}  // namespace relmap
