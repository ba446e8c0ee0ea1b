// Converts pictures of a simulated camera to those that another camera would have taken.
#pragma once

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "proto/geometry/camera.h"

namespace relmap::testing {

inline cv::Mat intrinsics_of(const StereoCamera& camera) {
  return (cv::Mat_<double>(3, 3) << camera.f, 0, camera.cx, 0, camera.f, camera.cy, 0, 0, 1);
}

inline cv::Mat turn(const cv::Vec3d& degrees) {
  cv::Mat R;
  cv::Rodrigues(degrees * (CV_PI / 180), R);
  return R;
}

// The picture through a lens with this distortion (k1, k2, p1, p2, k3 of OpenCV), rotated by `degrees` about each axis.
inline cv::Mat through_lens(const cv::Mat& picture, const StereoCamera& camera, const std::vector<double>& distortion,
                            const cv::Vec3d& degrees = {}) {
  std::vector<cv::Point2f> pixels, sources;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) pixels.emplace_back(static_cast<float>(x), static_cast<float>(y));
  const cv::Mat K = intrinsics_of(camera);
  // To a thousandth of a pixel: OpenCV stops earlier, which would be another lens at the corners.
  const cv::TermCriteria exactly(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-3);
  cv::undistortPoints(pixels, sources, K, distortion, turn(degrees), K, exactly);
  const cv::Mat map = cv::Mat(sources, true).reshape(2, picture.rows);
  cv::Mat seen;
  cv::remap(picture, seen, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return seen;
}

}  // namespace relmap::testing
