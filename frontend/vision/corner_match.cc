#include "frontend/vision/corner_match.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/vision/corners.h"
#include "frontend/vision/exposure.h"
#include "frontend/vision/patch.h"
#include "frontend/vision/spread.h"
#include "frontend/vision/template.h"

namespace relmap::vision {

namespace {

constexpr std::size_t kMaxCorners = 4000;  // candidates in a picture
constexpr float kCornersApart = 8;         // pixels between corners to match, at least
constexpr int kSamePlace = 2;              // pixels
constexpr int kSurroundings = 12;          // pixels to each side
constexpr double kMinAround = 0.6;  // correlation of the surroundings; slanted or partly hidden ones differ somewhat

struct Eye {
  Image picture;
  std::vector<Corner> corners;
};

Eye see(ImageView picture, int wanted) {
  Eye eye{standardise(picture, measure_exposure(picture)), {}};
  eye.corners = CornerDetector({.wanted = wanted}).detect(Pyramid(ImageView(eye.picture), 1))[0];
  if (eye.corners.size() > kMaxCorners) {
    const auto better = [](const Corner& a, const Corner& b) { return a.score > b.score; };
    std::nth_element(eye.corners.begin(), eye.corners.begin() + kMaxCorners, eye.corners.end(), better);
    eye.corners.resize(kMaxCorners);
  }
  return eye;
}

bool near(const Corner& a, const Corner& b, int columns, int rows) {
  return std::abs(a.x - b.x) <= columns && std::abs(a.y - b.y) <= rows;
}

// The only corner of `to` that looks like `corner` of `from`; null if there is none, or if several do.
const Corner* find(const Corner& corner, const Eye& from, const Eye& to, int columns, int rows, float uniqueness) {
  const SadPatch patch(from.picture, corner.x, corner.y);
  const Corner* best = nullptr;
  int min_sad = std::numeric_limits<int>::max(), second = min_sad;
  for (const Corner& candidate : to.corners) {
    if (!near(candidate, corner, columns, rows)) continue;
    const int sad = patch.compare(to.picture, candidate.x, candidate.y);
    if (sad < min_sad) {
      if (best && !near(*best, candidate, kSamePlace, kSamePlace)) second = min_sad;
      best = &candidate, min_sad = sad;
    } else if (sad < second && !near(*best, candidate, kSamePlace, kSamePlace)) {
      second = sad;
    }
  }
  return static_cast<float>(min_sad) < uniqueness * static_cast<float>(second) ? best : nullptr;
}

// Normalised correlation of the surroundings of two places: patches that look alike by chance have different ones.
double correlation_around(const Image& left, const Corner& corner, const Image& right, float x, float y) {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (int dy = -kSurroundings; dy <= kSurroundings; ++dy)
    for (int dx = -kSurroundings; dx <= kSurroundings; ++dx) {
      const int u = corner.x + dx, v = corner.y + dy;
      const float ur = x + static_cast<float>(dx), vr = y + static_cast<float>(dy);
      if (u < 0 || v < 0 || u >= left.width() || v >= left.height()) continue;
      if (ur < 0 || vr < 0 || ur >= static_cast<float>(right.width() - 1) ||
          vr >= static_cast<float>(right.height() - 1))
        continue;
      const double p = left.at(u, v), q = sample(right, ur, vr);
      ++n, a += p, b += q, aa += p * p, bb += q * q, ab += p * q;
    }
  const double square = (n * aa - a * a) * (n * bb - b * b);
  return square > 0 ? (n * ab - a * b) / std::sqrt(square) : 0;
}

}  // namespace

std::vector<CornerMatch> match_corners(ImageView left_picture, ImageView right_picture,
                                       const CornerMatchOptions& options) {
  const Eye left = see(left_picture, 2 * options.wanted), right = see(right_picture, 2 * options.wanted);
  const int columns = static_cast<int>(options.columns * static_cast<float>(left_picture.width));
  const int rows = static_cast<int>(options.rows * static_cast<float>(left_picture.height));
  std::vector<CornerMatch> matches;
  for (const std::uint32_t i :
       choose_spread(left.corners, {}, left_picture.width, left_picture.height, options.wanted, kCornersApart)) {
    const Corner& corner = left.corners[i];
    const Corner* there = find(corner, left, right, columns, rows, options.uniqueness);
    if (!there) continue;
    const Corner* back = find(*there, right, left, columns, rows, 1);
    if (!back || !near(*back, corner, kSamePlace, kSamePlace)) continue;
    const auto patch = Template::from_image(left.picture, corner.x, corner.y);
    const auto aligned = patch ? patch->align(right.picture, there->x, there->y) : std::nullopt;
    if (aligned && aligned->correlation >= options.min_correlation &&
        correlation_around(left.picture, corner, right.picture, aligned->x, aligned->y) >= kMinAround)
      matches.push_back({static_cast<float>(corner.x), static_cast<float>(corner.y), aligned->x, aligned->y});
  }
  return matches;
}

}  // namespace relmap::vision
