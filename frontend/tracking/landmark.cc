#include "frontend/tracking/landmark.h"

#include <Eigen/LU>

namespace relmap::tracking {

namespace {

constexpr double kMinJoinedDisparity = 0.2;  // pixels; below it there is no depth

}  // namespace

vision::Warp Landmark::warp(const SE3& T_camera_keyframe) const {
  const double depth = (T_camera_keyframe * point).z();
  const Eigen::Matrix2d m =
      depth / anchor_depth * (R_anchor_keyframe * T_camera_keyframe.R.transpose()).topLeftCorner<2, 2>();
  return {static_cast<float>(m(0, 0)), static_cast<float>(m(0, 1)), static_cast<float>(m(1, 0)),
          static_cast<float>(m(1, 1))};
}

void Landmark::take_anchor(vision::ImageView level_image, float x, float y, const SE3& T_camera_keyframe) {
  const auto taken = vision::Anchor::take(level_image, x, y);
  if (!taken) return;
  anchor = *taken;
  anchor_depth = (T_camera_keyframe * point).z();
  R_anchor_keyframe = T_camera_keyframe.R;
}

StereoEstimate to_pixels(const StereoCamera& camera, const Vector3& point, const Matrix3& covariance) {
  const Matrix3 H = camera.jacobian(point);
  return {camera.project(point), H * covariance * H.transpose()};
}

void from_pixels(const StereoCamera& camera, const StereoEstimate& estimate, Vector3& point, Matrix3& covariance) {
  point = camera.triangulate(estimate.pixel);
  const Matrix3 inverse = camera.jacobian(point).inverse();
  covariance = inverse * estimate.covariance * inverse.transpose();
}

bool join_measurement(const StereoCamera& camera, const StereoPixel& pixel, double sigma, Vector3& point,
                      Matrix3& covariance) {
  StereoEstimate estimate = to_pixels(camera, point, covariance);
  const int rows = is_mono(pixel) ? 2 : 3;
  using Gain = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3>;
  using Innovation = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;
  const Innovation S = estimate.covariance.topLeftCorner(rows, rows) + sigma * sigma * Innovation::Identity(rows, rows);
  const Gain K = estimate.covariance.leftCols(rows) * S.inverse();
  const Vector3 step = K * (pixel.head(rows) - estimate.pixel.head(rows));
  estimate.pixel += step;
  estimate.covariance -= (K * estimate.covariance.topRows(rows)).eval();
  estimate.covariance = 0.5 * (estimate.covariance + estimate.covariance.transpose()).eval();
  if (!(estimate.pixel.x() - estimate.pixel.z() > kMinJoinedDisparity)) return false;
  from_pixels(camera, estimate, point, covariance);
  return true;
}

}  // namespace relmap::tracking
