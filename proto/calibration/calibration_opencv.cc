#include "proto/calibration/calibration_yaml.h"

namespace relmap {

namespace {

using namespace calibration_yaml;

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

}  // namespace

Result<StereoCalibration> parse_opencv_calibration(std::string_view text) {
  return guarded([&] { return plausible(read_opencv(text)); });
}

}  // namespace relmap
