#include "frontend/tracking/new_landmarks.h"

#include <algorithm>
#include <cmath>

#include "frontend/tracking/disparity_range.h"
#include "frontend/vision/stereo_match.h"

namespace relmap::tracking {

namespace {

constexpr float kMinStartDisparity = 1.0F;  // pixels; below that the depth is too uncertain
constexpr float kApart = 0.012F;            // distance between landmarks, as a share of the picture's width
constexpr float kBerth = 0.03F;             // distance from points to avoid, as a share of the picture's width
constexpr int kRounds = 3;                  // of replacing corners that have no stereo match

// Share of the wanted tracks on `level` and the coarser levels above it: each level has a third of the one below it.
// Fine levels measure better, coarse ones are found from further away.
double share_from(int level, int levels) {
  const double all = 1 - std::pow(1.0 / 3, levels);
  return (std::pow(1.0 / 3, level) - std::pow(1.0 / 3, levels)) / all;
}

std::optional<NewLandmark> start_at(const Pair& pair, const StereoCamera& camera, const vision::Corner& corner,
                                    int level, double sigma, double offset) {
  const auto x = static_cast<float>(corner.x), y = static_cast<float>(corner.y);
  const float u = vision::from_level(x, level), v = vision::from_level(y, level);
  const auto match =
      vision::match_stereo(pair.left, pair.right, u, v, level, disparity_range(camera, kMinStartDisparity));
  if (!match) return std::nullopt;
  NewLandmark made;
  const double disparity = match->disparity - offset;
  if (!(disparity > 0.5 * kMinStartDisparity && u - disparity >= 0)) return std::nullopt;
  made.pixel = {u, v, u - disparity};
  const double scale = sigma * pixel_sigma(level);
  from_pixels(camera, {made.pixel, scale * scale * Matrix3::Identity()}, made.landmark.point, made.landmark.covariance);
  made.landmark.level = level;
  made.landmark.take_anchor(pair.left.level(level), x, y, SE3());
  if (made.landmark.anchor_depth <= 0) return std::nullopt;
  return made;
}

}  // namespace

std::vector<NewLandmark> start_landmarks(const Pair& pair, const std::vector<std::vector<vision::Corner>>& corners,
                                         const StereoCamera& camera, std::span<const TakenPoint> taken,
                                         std::span<const vision::PicturePoint> avoid, int wanted, double sigma,
                                         double offset) {
  std::vector<NewLandmark> made;
  std::vector<TakenPoint> all(taken.begin(), taken.end());
  const int levels = pair.left.levels();
  for (int level = levels - 1; level >= 0; --level) {
    // From the coarsest level down, each level is filled up to the share of it and the coarser levels together. Tracks
    // on finer levels do not count toward that: they are always plenty and would in time displace all others.
    std::vector<vision::PicturePoint> here;
    for (const TakenPoint& t : all)
      if (t.level >= level) here.push_back({vision::to_level(t.point.x, level), vision::to_level(t.point.y, level)});
    const int due = static_cast<int>(std::lround(share_from(level, levels) * wanted));
    std::vector<vision::Corner> candidates = corners[static_cast<std::size_t>(level)];
    const float berth = kBerth * static_cast<float>(camera.width);
    std::erase_if(candidates, [&](const vision::Corner& c) {
      const float u = vision::from_level(static_cast<float>(c.x), level),
                  v = vision::from_level(static_cast<float>(c.y), level);
      return std::any_of(avoid.begin(), avoid.end(), [&](const vision::PicturePoint& p) {
        return (p.x - u) * (p.x - u) + (p.y - v) * (p.y - v) < berth * berth;
      });
    });
    const vision::ImageView image = pair.left.level(level);
    for (int round = 0; round < kRounds && static_cast<int>(here.size()) < due && !candidates.empty(); ++round) {
      const float apart = std::max(3.0F, kApart * static_cast<float>(image.width));
      const auto chosen = vision::choose_spread(candidates, here, image.width, image.height, due, apart);
      if (chosen.empty()) break;
      std::vector<char> used(candidates.size(), 0);
      for (const std::uint32_t i : chosen) {
        used[i] = 1;
        auto landmark = start_at(pair, camera, candidates[i], level, sigma, offset);
        if (!landmark) continue;
        here.push_back({static_cast<float>(candidates[i].x), static_cast<float>(candidates[i].y)});
        all.push_back({{static_cast<float>(landmark->pixel.x()), static_cast<float>(landmark->pixel.y())}, level});
        made.push_back(std::move(*landmark));
      }
      std::vector<vision::Corner> left_over;
      for (std::size_t i = 0; i < candidates.size(); ++i)
        if (!used[i]) left_over.push_back(candidates[i]);
      candidates = std::move(left_over);
    }
  }
  return made;
}

}  // namespace relmap::tracking
