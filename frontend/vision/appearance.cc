#include "frontend/vision/appearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace relmap::vision {

namespace {

constexpr int kLayers = 3;
constexpr double kContrast = 0.02;
constexpr double kEdge = 10;
constexpr double kSigma = 1.6;
constexpr double kTrackedSigma = 2.5;  // of a tracked feature's region, at level 0
constexpr int kMinSiftSide = 16;

cv::Mat as_mat(ImageView image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

cv::Ptr<cv::SIFT> make_sift() { return cv::SIFT::create(0, kLayers, kContrast, kEdge, kSigma, CV_8U); }

// SIFT always doubles its input. Given the halved picture, its first octave is the picture itself: that takes a quarter
// of the time and memory, and the keypoints lost are those of the finest scale, which are the least repeatable.
// Doubling moves pixel centres: a position x of the picture is x/2 in SIFT's coordinates of the halved one (exactly:
// the quarter pixels of halving and doubling cancel), and x + 1/4 in those of the whole one.
struct Base {
  cv::Mat image;
  float scale;   // SIFT's coordinates per pixel of the picture
  float offset;  // added after scaling

  static Base halved(const cv::Mat& grey) {
    cv::Mat half;
    cv::resize(grey(cv::Rect(0, 0, grey.cols & ~1, grey.rows & ~1)), half, {}, 0.5, 0.5, cv::INTER_AREA);
    return {half, 0.5F, 0.0F};
  }
  static Base whole(const cv::Mat& grey) { return {grey, 1.0F, 0.25F}; }

  cv::Point2f to_sift(float u, float v) const { return {u * scale + offset, v * scale + offset}; }
  cv::Point2f to_picture(cv::Point2f p) const { return {(p.x - offset) / scale, (p.y - offset) / scale}; }
};

bool stronger(const cv::KeyPoint& a, const cv::KeyPoint& b) {
  if (a.response != b.response) return a.response > b.response;
  if (a.pt.y != b.pt.y) return a.pt.y < b.pt.y;
  if (a.pt.x != b.pt.x) return a.pt.x < b.pt.x;
  if (a.size != b.size) return a.size < b.size;
  return a.angle < b.angle;
}

std::vector<cv::KeyPoint> detect_all(const Base& base) {
  std::vector<cv::KeyPoint> keypoints;
  if (std::min(base.image.cols, base.image.rows) < kMinSiftSide / 2) return keypoints;
  make_sift()->detect(base.image, keypoints);
  std::sort(keypoints.begin(), keypoints.end(), stronger);
  const auto same_place = [](const cv::KeyPoint& a, const cv::KeyPoint& b) { return a.pt == b.pt && a.size == b.size; };
  keypoints.erase(std::unique(keypoints.begin(), keypoints.end(), same_place), keypoints.end());
  return keypoints;
}

// `wanted` of the sorted keypoints, in rounds over cells of about equal sides.
std::vector<cv::KeyPoint> spread(const std::vector<cv::KeyPoint>& sorted, cv::Size size, int wanted) {
  if (wanted <= 0) return {};
  if (static_cast<int>(sorted.size()) <= wanted) return sorted;
  const double side = std::max(8.0, std::sqrt(static_cast<double>(size.area()) / std::max(1, wanted / 5)));
  const int columns = std::max(1, static_cast<int>(std::lround(size.width / side)));
  const int rows = std::max(1, static_cast<int>(std::lround(size.height / side)));
  std::vector<int> taken(static_cast<std::size_t>(columns * rows), 0);
  std::vector<int> round(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const int cx =
        std::clamp(static_cast<int>(sorted[i].pt.x * static_cast<float>(columns) / static_cast<float>(size.width)), 0,
                   columns - 1);
    const int cy = std::clamp(
        static_cast<int>(sorted[i].pt.y * static_cast<float>(rows) / static_cast<float>(size.height)), 0, rows - 1);
    round[i] = taken[static_cast<std::size_t>(cy * columns + cx)]++;
  }
  std::vector<std::size_t> order(sorted.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return round[a] < round[b]; });
  order.resize(static_cast<std::size_t>(wanted));
  std::sort(order.begin(), order.end());
  std::vector<cv::KeyPoint> chosen;
  chosen.reserve(order.size());
  for (const std::size_t i : order) chosen.push_back(sorted[i]);
  return chosen;
}

// Strongest direction of the gradient round each position: histogram of 36 bins, smoothed, peak interpolated (Lowe
// 2004, 5), on a pyramid blurred to about the sigma of the region.
class Orientation {
 public:
  explicit Orientation(const cv::Mat& grey) { levels_.push_back(grey); }

  float degrees(const TrackedPosition& position) {
    const cv::Mat& image = blurred(position.level);
    const float scale = 1.0F / static_cast<float>(1 << position.level);
    const int x0 = cvRound((position.u + 0.5F) * scale - 0.5F);
    const int y0 = cvRound((position.v + 0.5F) * scale - 0.5F);
    const double window = 1.5 * kTrackedSigma;
    const int radius = cvRound(3 * window);
    std::array<float, 36> bins{};
    for (int dy = -radius; dy <= radius; ++dy) {
      const int y = y0 + dy;
      if (y <= 0 || y >= image.rows - 1) continue;
      for (int dx = -radius; dx <= radius; ++dx) {
        const int x = x0 + dx;
        if (x <= 0 || x >= image.cols - 1) continue;
        const float gx =
            static_cast<float>(image.at<std::uint8_t>(y, x + 1)) - static_cast<float>(image.at<std::uint8_t>(y, x - 1));
        const float gy =
            static_cast<float>(image.at<std::uint8_t>(y - 1, x)) - static_cast<float>(image.at<std::uint8_t>(y + 1, x));
        const auto weight = static_cast<float>(std::exp(-(dx * dx + dy * dy) / (2 * window * window)));
        const int bin = cvRound(cv::fastAtan2(gy, gx) / 10) % 36;
        bins[static_cast<std::size_t>(bin)] += weight * std::sqrt(gx * gx + gy * gy);
      }
    }
    const auto at = [&](int i) { return bins[static_cast<std::size_t>((i + 72) % 36)]; };
    std::array<float, 36> smooth{};
    for (int i = 0; i < 36; ++i)
      smooth[static_cast<std::size_t>(i)] =
          (at(i - 2) + at(i + 2)) / 16 + (at(i - 1) + at(i + 1)) * 4 / 16 + at(i) * 6 / 16;
    const auto peak = std::max_element(smooth.begin(), smooth.end());
    const int i = static_cast<int>(peak - smooth.begin());
    const float l = smooth[static_cast<std::size_t>((i + 35) % 36)], r = smooth[static_cast<std::size_t>((i + 1) % 36)];
    const float curvature = l - 2 * *peak + r;
    const float bin = static_cast<float>(i) + (curvature < 0 ? 0.5F * (l - r) / curvature : 0);
    // OpenCV counts a keypoint's angle clockwise on the screen.
    float angle = 360 - bin * 10;
    if (angle >= 360) angle -= 360;
    return angle;
  }

 private:
  const cv::Mat& blurred(int level) {
    while (static_cast<int>(levels_.size()) <= level) {
      const cv::Mat& finer = levels_.back();
      if (std::min(finer.cols, finer.rows) < 8) {
        levels_.push_back(finer.clone());
        continue;
      }
      cv::Mat half;
      cv::resize(finer, half, cv::Size(finer.cols / 2, finer.rows / 2), 0, 0, cv::INTER_AREA);
      levels_.push_back(half);
    }
    blurred_.resize(levels_.size());
    cv::Mat& image = blurred_[static_cast<std::size_t>(level)];
    if (image.empty()) cv::GaussianBlur(levels_[static_cast<std::size_t>(level)], image, {}, 2.0);
    return image;
  }
  std::vector<cv::Mat> levels_, blurred_;
};

// The keypoint whose sigma is `sigma` pixels of the picture, filed under the octave and layer that SIFT's detector
// would have used.
cv::KeyPoint keypoint_at(const Base& base, const TrackedPosition& position, double sigma, float angle) {
  const double steps =
      std::log2(std::max(sigma * base.scale / (kSigma / 2), 1.0)) * kLayers;  // from octave -1, layer 0
  int step = std::max(1, static_cast<int>(std::lround(steps)));
  const int octaves = std::max(1, cvRound(std::log2(std::min(base.image.cols, base.image.rows) * 2.0) - 2));
  step = std::min(step, octaves * kLayers);
  const int octave = (step - 1) / kLayers - 1;
  const int layer = (step - 1) % kLayers + 1;
  cv::KeyPoint keypoint(base.to_sift(position.u, position.v), static_cast<float>(2 * sigma * base.scale), angle);
  keypoint.octave = (octave & 255) | (layer << 8);
  return keypoint;
}

std::vector<cv::KeyPoint> tracked_keypoints(const Base& base, const cv::Mat& grey,
                                            std::span<const TrackedPosition> tracked) {
  std::vector<cv::KeyPoint> keypoints;
  keypoints.reserve(tracked.size());
  Orientation orientation(grey);
  for (TrackedPosition position : tracked) {
    position.level = std::clamp(position.level, 0, kMaxPyramidLevel);
    keypoints.push_back(
        keypoint_at(base, position, kTrackedSigma * (1 << position.level), orientation.degrees(position)));
  }
  return keypoints;
}

std::vector<AppearanceFeature> describe(const Base& base, std::vector<cv::KeyPoint>& keypoints) {
  std::vector<AppearanceFeature> features(keypoints.size());
  if (keypoints.empty()) return features;
  // SIFT may reorder or drop keypoints; class_id assigns each descriptor to its feature.
  for (std::size_t i = 0; i < keypoints.size(); ++i) keypoints[i].class_id = static_cast<int>(i);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const cv::Point2f p = base.to_picture(keypoints[i].pt);
    features[i].u = p.x;
    features[i].v = p.y;
    features[i].disparity = std::numeric_limits<float>::quiet_NaN();
    features[i].scale = keypoints[i].size / base.scale;
    features[i].angle = static_cast<float>(keypoints[i].angle * std::numbers::pi / 180);
  }
  cv::Mat descriptors;
  make_sift()->compute(base.image, keypoints, descriptors);
  for (int row = 0; row < descriptors.rows; ++row) {
    auto& feature = features[static_cast<std::size_t>(keypoints[static_cast<std::size_t>(row)].class_id)];
    std::copy_n(descriptors.ptr<std::uint8_t>(row), 128, feature.descriptor.begin());
  }
  return features;
}

// The base that yields enough keypoints, and these, strongest first.
std::pair<Base, std::vector<cv::KeyPoint>> detect_enough(const cv::Mat& grey, int wanted) {
  Base base = Base::halved(grey);
  auto keypoints = detect_all(base);
  if (static_cast<int>(keypoints.size()) < wanted) {
    base = Base::whole(grey);
    keypoints = detect_all(base);
  }
  return {std::move(base), std::move(keypoints)};
}

bool too_small(ImageView grey) { return std::min(grey.width, grey.height) < kMinSiftSide; }

}  // namespace

std::vector<AppearanceFeature> detect_appearance(ImageView grey, int max_features) {
  return detect_appearance(grey, {}, max_features);
}

std::vector<AppearanceFeature> describe_tracked(ImageView grey, std::span<const TrackedPosition> positions) {
  return detect_appearance(grey, positions, 0);
}

std::vector<AppearanceFeature> detect_appearance(ImageView grey, std::span<const TrackedPosition> tracked,
                                                 int max_features) {
  if (too_small(grey)) return {};
  const cv::Mat picture = as_mat(grey);
  const int wanted = std::max(0, max_features - static_cast<int>(tracked.size()));
  auto [base, detected] =
      wanted > 0 ? detect_enough(picture, wanted) : std::pair{Base::halved(picture), std::vector<cv::KeyPoint>{}};
  auto keypoints = tracked_keypoints(base, picture, tracked);
  const std::size_t count = keypoints.size();
  std::erase_if(detected, [&](const cv::KeyPoint& candidate) {
    return std::any_of(keypoints.begin(), keypoints.end(), [&](const cv::KeyPoint& other) {
      const cv::Point2f d = other.pt - candidate.pt;
      const float near = 0.25F * other.size;
      return d.dot(d) < near * near && candidate.size < 1.5F * other.size && other.size < 1.5F * candidate.size;
    });
  });
  const auto chosen = spread(detected, base.image.size(), wanted);
  keypoints.insert(keypoints.end(), chosen.begin(), chosen.end());
  auto features = describe(base, keypoints);
  for (std::size_t i = 0; i < count; ++i) {
    features[i].u = tracked[i].u;
    features[i].v = tracked[i].v;
    features[i].track = tracked[i].track;
  }
  return features;
}

}  // namespace relmap::vision
