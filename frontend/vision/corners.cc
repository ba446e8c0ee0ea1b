#include "frontend/vision/corners.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>

namespace relmap::vision {

namespace {

constexpr int kStartThreshold = 20;

std::vector<cv::KeyPoint> fast(ImageView image, int threshold) {
  std::vector<cv::KeyPoint> keypoints;
  const cv::Mat mat(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                    static_cast<std::size_t>(image.stride));
  cv::FAST(mat, keypoints, threshold, true, cv::FastFeatureDetector::TYPE_9_16);
  return keypoints;
}

// In most pictures the number of corners falls about as the inverse square of the threshold, in some much faster. Steps
// are small enough not to overshoot in those.
int steered(int threshold, std::size_t found, int wanted, const CornerOptions& options) {
  const double ratio = std::cbrt((static_cast<double>(found) + 1) / (wanted + 1.0));
  const int next = static_cast<int>(std::lround(threshold * std::clamp(ratio, 0.7, 1.3)));
  return std::clamp(next, options.min_threshold, options.max_threshold);
}

}  // namespace

float harris_score(ImageView image, int x, int y) {
  int xx = 0, yy = 0, xy = 0;
  for (int dy = -3; dy <= 3; ++dy) {
    const std::uint8_t* above = image.row(y + dy - 1) + x;
    const std::uint8_t* here = image.row(y + dy) + x;
    const std::uint8_t* below = image.row(y + dy + 1) + x;
    for (int dx = -3; dx <= 3; ++dx) {
      const int gx = 2 * (here[dx + 1] - here[dx - 1]) + above[dx + 1] - above[dx - 1] + below[dx + 1] - below[dx - 1];
      const int gy = 2 * (below[dx] - above[dx]) + below[dx - 1] - above[dx - 1] + below[dx + 1] - above[dx + 1];
      xx += gx * gx;
      yy += gy * gy;
      xy += gx * gy;
    }
  }
  constexpr float kNorm = 1.0F / (49 * 64);  // pixels of the window, square of the Sobel kernel's gain
  const float a = static_cast<float>(xx) * kNorm, b = static_cast<float>(yy) * kNorm,
              c = static_cast<float>(xy) * kNorm;
  return a * b - c * c - 0.04F * (a + b) * (a + b);
}

CornerDetector::CornerDetector(const CornerOptions& options) : options_(options) {
  options_.border = std::max(options_.border, 4);
  thresholds_.fill(std::clamp(kStartThreshold, options_.min_threshold, options_.max_threshold));
}

std::vector<std::vector<Corner>> CornerDetector::detect(const Pyramid& pyramid) {
  std::vector<std::vector<Corner>> corners(static_cast<std::size_t>(pyramid.levels()));
  for (int level = 0; level < pyramid.levels(); ++level) {
    const ImageView image = pyramid.level(level);
    int& threshold =
        thresholds_[static_cast<std::size_t>(std::min<int>(level, static_cast<int>(thresholds_.size()) - 1))];
    const int wanted = std::max(20, options_.wanted >> level);
    auto keypoints = fast(image, threshold);
    // A dark or blurred picture must give corners at once, not only after the threshold has adapted.
    for (int attempt = 0; attempt < 2 && static_cast<int>(keypoints.size()) < wanted / 2; ++attempt) {
      const int lower = steered(threshold, keypoints.size(), wanted, options_);
      if (lower >= threshold) break;
      threshold = lower;
      keypoints = fast(image, threshold);
    }
    threshold = steered(threshold, keypoints.size(), wanted, options_);
    const int right = image.width - options_.border, bottom = image.height - options_.border;
    for (const cv::KeyPoint& keypoint : keypoints) {
      const int x = cvRound(keypoint.pt.x), y = cvRound(keypoint.pt.y);
      if (x < options_.border || y < options_.border || x >= right || y >= bottom) continue;
      const float score = harris_score(image, x, y);
      if (score > 0)
        corners[static_cast<std::size_t>(level)].push_back(
            {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), score});
    }
  }
  return corners;
}

}  // namespace relmap::vision
