#include "frontend/tracking/recovery.h"

#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "frontend/tracking/landmark.h"
#include "frontend/vision/appearance.h"

namespace relmap::tracking {

namespace {

constexpr float kMinRecoveryDisparity = 1.0F;  // pixels
constexpr double kRatio = 0.8;                 // distance to the best / to the second best (Lowe 2004, 7.1)
constexpr int kHypothesis = 12;                // inliers
constexpr std::size_t kEnough = 30;
constexpr int kFeatures = 400;
constexpr double kMaxRms = 0.02;  // of the picture's width

using Descriptor = std::array<std::uint8_t, 128>;

int distance(const Descriptor& a, const Descriptor& b) {
  int sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int d = int{a[i]} - int{b[i]};
    sum += d * d;
  }
  return sum;
}

// The standard deviation of a SIFT keypoint's position grows with the diameter of the region that it describes.
double feature_sigma(double scale, double pixel_sigma) { return pixel_sigma * std::max(2.0, 0.2 * scale); }

// A window or poster that looks like another gives a wrong pose with many inliers, all in one place of the picture.
bool spread_out(const std::vector<vision::Correspondence>& matches, const vision::Motion& motion,
                const StereoCamera& camera) {
  constexpr int kColumns = 8, kRows = 6;
  constexpr std::size_t kMinCells = 10;
  std::set<int> cells;
  for (const std::uint32_t i : motion.inliers) {
    const StereoPixel& pixel = matches[i].pixel;
    cells.insert(static_cast<int>(kColumns * pixel.x() / camera.width) +
                 kColumns * static_cast<int>(kRows * pixel.y() / camera.height));
  }
  return cells.size() >= kMinCells;
}

}  // namespace

std::vector<DescribedPoint> described_points(const Keyframe& keyframe, double pixel_sigma) {
  const StereoCamera& camera = keyframe.session.camera;
  std::vector<DescribedPoint> points;
  for (const AppearanceFeature& feature : keyframe.appearance) {
    if (!(feature.disparity >= kMinRecoveryDisparity)) continue;
    DescribedPoint point;
    const double sigma = feature_sigma(feature.scale, pixel_sigma);
    from_pixels(camera, {{feature.u, feature.v, feature.u - feature.disparity}, sigma * sigma * Matrix3::Identity()},
                point.point, point.covariance);
    point.descriptor = feature.descriptor;
    points.push_back(point);
  }
  return points;
}

Result<Recognition> recognise(std::span<const DescribedPoint> points, vision::ImageView left,
                              const StereoCamera& camera, const std::optional<vision::MotionLimits>& limits,
                              std::uint64_t seed) {
  const auto features = vision::detect_appearance(left, kFeatures);
  std::vector<vision::Correspondence> matches;
  for (const AppearanceFeature& feature : features) {
    int best = std::numeric_limits<int>::max(), second = best;
    const DescribedPoint* found = nullptr;
    for (const DescribedPoint& point : points) {
      const int d = distance(feature.descriptor, point.descriptor);
      if (d < best) {
        second = best;
        best = d;
        found = &point;
      } else if (d < second) {
        second = d;
      }
    }
    if (!found || best >= kRatio * kRatio * second) continue;
    matches.push_back(
        {found->point, {feature.u, feature.v, kNoRight}, feature_sigma(feature.scale, 0.5), found->covariance});
  }
  vision::MotionOptions options;
  options.seed = seed;
  options.limits = limits;
  options.max_trials = 1000;
  options.min_inliers = kHypothesis;
  auto motion = vision::estimate_motion(matches, camera, options);
  if (!motion.ok()) return motion.status();
  // If the pose is close in front of uncertain points, any pixel lies within their gates.
  if (motion->rms_px > kMaxRms * camera.width)
    return {Reason::TOO_FEW_INLIERS, "the matches agree only where the points tell nothing"};
  Status doubt;
  if (motion->inliers.size() < kEnough)
    doubt = {Reason::TOO_FEW_INLIERS, std::to_string(motion->inliers.size()) + " matches agree"};
  else if (!spread_out(matches, *motion, camera))
    doubt = {Reason::POOR_SPREAD, "the matches lie together: likely one thing that looks like another"};
  return Recognition{std::move(*motion), std::move(doubt)};
}

}  // namespace relmap::tracking
