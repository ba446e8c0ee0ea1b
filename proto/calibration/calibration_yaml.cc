#include "proto/calibration/calibration_yaml.h"

#include <algorithm>

namespace relmap::calibration_yaml {

YAML::Node load(std::string_view text) {
  if (text.size() > kMaxCalibrationBytes) fail(Reason::CORRUPT, "too long for a calibration");
  // OpenCV and EuRoC begin with "%YAML:1.0", which is not a valid YAML directive.
  if (text.starts_with("%YAML")) text.remove_prefix(std::min(text.find('\n'), text.size()));
  YAML::Node root = YAML::Load(std::string(text));
  if (!root.IsMap()) fail(Reason::CORRUPT, "no calibration: the YAML is not a map");
  return root;
}

YAML::Node find(const YAML::Node& root, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const YAML::Node node = root[name]; node.IsDefined()) return node;
  return YAML::Node(YAML::NodeType::Undefined);
}

std::vector<double> numbers(const YAML::Node& node, const char* what, std::size_t min_count, std::size_t max_count) {
  const YAML::Node list = node.IsMap() ? node["data"] : node;
  std::vector<double> values;
  if (list.IsDefined() && list.IsSequence() && list.size() <= max_count)
    for (const YAML::Node& item : list) {
      if (!item.IsSequence()) {
        values.push_back(item.as<double>());
        continue;
      }
      for (const YAML::Node& number : item)
        if (values.size() <= max_count) values.push_back(number.as<double>());
    }
  if (values.size() < min_count || values.size() > max_count) {
    const std::string count = std::to_string(min_count);
    fail(Reason::CORRUPT, what, " is not a list of ",
         min_count == max_count ? count : count + " to " + std::to_string(max_count), " numbers");
  }
  return values;
}

void set_distortion(RawCamera& camera, const std::vector<double>& d, const char* what) {
  for (std::size_t i = 5; i < d.size(); ++i)
    if (d[i] != 0) fail(Reason::UNSUPPORTED, what, " has coefficients other than k1, k2, p1, p2, k3");
  const auto at = [&](std::size_t i) { return i < d.size() ? d[i] : 0.0; };
  camera.k1 = at(0), camera.k2 = at(1), camera.p1 = at(2), camera.p2 = at(3), camera.k3 = at(4);
}

void set_size(StereoCalibration& calibration, const std::vector<double>& size) {
  for (const double side : size)
    if (!(side >= 16 && side <= 16384))
      fail(Reason::IMPLAUSIBLE_CALIBRATION, "a side of the picture has ", side, " px; must be 16..16384");
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

SE3 rigid(const std::vector<double>& r, const Vector3& t, const char* what) {
  SE3 T;
  for (int i = 0; i < 9; ++i) T.R(i / 3, i % 3) = r[static_cast<std::size_t>(i)];
  T.t = t;
  // Files hold a dozen digits or fewer; a larger deviation is a mistake.
  if (!T.R.allFinite() || (T.R * T.R.transpose()).isIdentity(1e-4) == false || T.R.determinant() < 0)
    fail(Reason::IMPLAUSIBLE_CALIBRATION, what, " is no rotation");
  return T.normalized();
}

SE3 rigid(const YAML::Node& matrix, const char* what) {
  const std::vector<double> m = numbers(matrix, what, 16, 16);
  return rigid({m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]}, what);
}

StereoCalibration plausible(StereoCalibration calibration) {
  if (Status s = calibration.check_plausible(); !s.ok()) throw Unreadable{s};
  return calibration;
}

}  // namespace relmap::calibration_yaml
