#include "tools/bench/klt_odometry.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

namespace relmap::bench {

namespace {

const cv::Size kFlowWindow(21, 21);
constexpr int kLevels = 3;
constexpr double kQuality = 0.01, kApart = 10;  // pixels
constexpr float kMaxRows = 2;                   // pixels between the rows of the two eyes
constexpr float kMinFollowedDisparity = 1;      // pixels
constexpr double kRefill = 0.75;                // of the features wanted
constexpr double kReprojection = 1.5;           // pixels
constexpr int kIterations = 200, kMinInliers = 12;

cv::Mat mat_of(vision::ImageView v) {
  return cv::Mat(v.height, v.width, CV_8UC1, const_cast<std::uint8_t*>(v.data), static_cast<std::size_t>(v.stride))
      .clone();
}

// Keeps the elements whose flag is set.
template <typename T>
void keep(std::vector<T>& values, const std::vector<char>& flags) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (flags[i]) values[kept++] = values[i];
  values.resize(kept);
}

}  // namespace

struct KltOdometry::Impl {
  StereoCamera camera;
  int wanted;
  std::vector<cv::Mat> left;  // pyramid of the last left picture
  std::vector<cv::Point2f> features;
  std::vector<cv::Point3d> points;  // of the features, in the last left camera's frame
  SE3 T_world_camera;
  SE3 step;
  int inliers = 0;

  // Depth for all features; those without one are dropped.
  void triangulate(const std::vector<cv::Mat>& right) {
    points.clear();
    if (features.empty()) return;
    std::vector<cv::Point2f> there = features;
    std::vector<unsigned char> found;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(left, right, features, there, found, error, kFlowWindow, kLevels);
    std::vector<char> good(features.size(), 0);
    for (std::size_t i = 0; i < features.size(); ++i) {
      const float disparity = features[i].x - there[i].x;
      good[i] = found[i] && disparity > kMinFollowedDisparity && std::abs(features[i].y - there[i].y) < kMaxRows;
      if (!good[i]) continue;
      const Vector3 p = camera.triangulate({features[i].x, features[i].y, there[i].x});
      points.emplace_back(p.x(), p.y(), p.z());
    }
    keep(features, good);
  }

  void refill() {
    if (static_cast<double>(features.size()) > kRefill * wanted) return;
    cv::Mat mask(left[0].rows, left[0].cols, CV_8UC1, cv::Scalar(255));
    for (const cv::Point2f& f : features) cv::circle(mask, f, static_cast<int>(kApart), 0, cv::FILLED);
    std::vector<cv::Point2f> fresh;
    cv::goodFeaturesToTrack(left[0], fresh, wanted - static_cast<int>(features.size()), kQuality, kApart, mask);
    features.insert(features.end(), fresh.begin(), fresh.end());
  }

  void move(const std::vector<cv::Mat>& next) {
    inliers = 0;
    std::vector<cv::Point2f> there;
    std::vector<unsigned char> found;
    std::vector<float> error;
    if (!features.empty()) cv::calcOpticalFlowPyrLK(left, next, features, there, found, error, kFlowWindow, kLevels);
    std::vector<char> good(features.size(), 0);
    for (std::size_t i = 0; i < features.size(); ++i) good[i] = found[i] && camera.in_picture(there[i].x, there[i].y);
    keep(there, good);
    keep(points, good);
    features = there;
    if (static_cast<int>(points.size()) >= kMinInliers) {
      const cv::Matx33d K(camera.f, 0, camera.cx, 0, camera.f, camera.cy, 0, 0, 1);
      cv::Vec3d rotation, translation;
      std::vector<int> agreed;
      if (cv::solvePnPRansac(points, features, K, cv::noArray(), rotation, translation, false, kIterations,
                             static_cast<float>(kReprojection), 0.999, agreed) &&
          static_cast<int>(agreed.size()) >= kMinInliers) {
        std::vector<cv::Point3d> p;
        std::vector<cv::Point2f> z;
        for (const int i : agreed) {
          p.push_back(points[static_cast<std::size_t>(i)]);
          z.push_back(features[static_cast<std::size_t>(i)]);
        }
        cv::solvePnPRefineLM(p, z, K, cv::noArray(), rotation, translation);
        const SE3 T_new_old{so3_exp({rotation[0], rotation[1], rotation[2]}),
                            {translation[0], translation[1], translation[2]}};
        step = T_new_old.inverse();
        inliers = static_cast<int>(agreed.size());
        features = z;
      }
    }
    T_world_camera = T_world_camera * step;
  }
};

KltOdometry::KltOdometry(const StereoCamera& camera, int features) : impl_(std::make_unique<Impl>()) {
  impl_->camera = camera;
  impl_->wanted = features;
}
KltOdometry::~KltOdometry() = default;

int KltOdometry::tracked() const { return impl_->inliers; }

SE3 KltOdometry::feed(vision::ImageView left, vision::ImageView right) {
  Impl& self = *impl_;
  std::vector<cv::Mat> next, next_right;
  cv::buildOpticalFlowPyramid(mat_of(left), next, kFlowWindow, kLevels);
  cv::buildOpticalFlowPyramid(mat_of(right), next_right, kFlowWindow, kLevels);
  if (!self.left.empty()) self.move(next);
  self.left = std::move(next);
  self.refill();
  self.triangulate(next_right);
  return self.T_world_camera;
}

}  // namespace relmap::bench
