#include "frontend/tracking/new_landmarks.h"

#include <algorithm>
#include <cmath>

#include "frontend/vision/stereo_match.h"

namespace relmap {

namespace {

constexpr double kLeastDepth = 0.4;      // metres
constexpr float kLeastDisparity = 1.0F;  // pixels: below that the depth is anybody's guess
constexpr float kApart = 0.012F;         // of the picture's width
constexpr int kRounds = 3;               // of replacing corners that have no stereo match

// Share of the wanted tracks that stand on levels 0..level, each level half as many as the one below it.
double cumulative_share(int level, int levels) {
  const double all = 2 - std::pow(0.5, levels - 1);
  return level < 0 ? 0 : (2 - std::pow(0.5, level)) / all;
}

std::optional<NewLandmark> start_at(const Pair& pair, const StereoCamera& camera, const Corner& corner, int level,
                                    double sigma, double offset) {
  const auto x = static_cast<float>(corner.x), y = static_cast<float>(corner.y);
  const float u = from_level(x, level), v = from_level(y, level);
  StereoMatchOptions options;
  options.min_disparity = kLeastDisparity;
  options.max_disparity = static_cast<float>(std::min(camera.f * camera.baseline / kLeastDepth, 0.4 * camera.width));
  const auto match = match_stereo(pair.left, pair.right, u, v, level, options);
  if (!match) return std::nullopt;
  NewLandmark made;
  const double disparity = match->disparity - offset;
  if (!(disparity > 0.5 * kLeastDisparity && u - disparity >= 0)) return std::nullopt;
  made.pixel = {u, v, u - disparity};
  const double scale = sigma * pixel_sigma(level);
  from_pixels(camera, {made.pixel, scale * scale * Matrix3::Identity()}, made.landmark.point, made.landmark.covariance);
  made.landmark.level = level;
  made.landmark.take_anchor(pair.left.level(level), x, y, SE3());
  if (made.landmark.anchor_depth <= 0) return std::nullopt;
  return made;
}

}  // namespace

std::vector<NewLandmark> start_landmarks(const Pair& pair, const std::vector<std::vector<Corner>>& corners,
                                         const StereoCamera& camera, std::span<const PicturePoint> taken, int wanted,
                                         double sigma, double offset) {
  std::vector<NewLandmark> made;
  std::vector<PicturePoint> all(taken.begin(), taken.end());
  const int levels = pair.left.levels();
  for (int level = levels - 1; level >= 0; --level) {
    // From the coarsest level on, each may fill up what it and those above it are due.
    const double share = 1 - cumulative_share(level - 1, levels);
    const int due = static_cast<int>(std::lround(share * wanted));
    std::vector<Corner> candidates = corners[static_cast<std::size_t>(level)];
    const ImageView image = pair.left.level(level);
    for (int round = 0; round < kRounds && static_cast<int>(all.size()) < due && !candidates.empty(); ++round) {
      std::vector<PicturePoint> here;
      for (const PicturePoint& p : all) here.push_back({to_level(p.x, level), to_level(p.y, level)});
      const float apart = std::max(3.0F, kApart * static_cast<float>(image.width));
      const auto chosen = choose_spread(candidates, here, image.width, image.height, due, apart);
      if (chosen.empty()) break;
      std::vector<char> used(candidates.size(), 0);
      for (const std::uint32_t i : chosen) {
        used[i] = 1;
        auto landmark = start_at(pair, camera, candidates[i], level, sigma, offset);
        if (!landmark) continue;
        all.push_back({static_cast<float>(landmark->pixel.x()), static_cast<float>(landmark->pixel.y())});
        made.push_back(std::move(*landmark));
      }
      std::vector<Corner> left_over;
      for (std::size_t i = 0; i < candidates.size(); ++i)
        if (!used[i]) left_over.push_back(candidates[i]);
      candidates = std::move(left_over);
    }
  }
  return made;
}

}  // namespace relmap
