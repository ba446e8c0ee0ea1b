#include "frontend/tracking/eyes.h"

#include <algorithm>
#include <string>

#include "frontend/vision/corners.h"
#include "frontend/vision/stereo_match.h"

namespace relmap {

namespace {

constexpr int kLevel = 1;  // where there is one
constexpr int kAnyMatches = 30, kManyTimes = 5;

// Corners of the one that the other sees further to the left, as a right eye does.
int matches(const Pyramid& left, const Pyramid& right) {
  StereoMatchOptions options;
  options.min_disparity = 1;
  options.max_disparity = 0.2F * static_cast<float>(left.level(0).width);
  const int level = std::min(kLevel, left.levels() - 1);
  int count = 0;
  const auto corners = CornerDetector({.wanted = 500}).detect(left);
  for (const Corner& corner : corners[static_cast<std::size_t>(level)])
    count += match_stereo(left, right, from_level(static_cast<float>(corner.x), level),
                          from_level(static_cast<float>(corner.y), level), level, options)
                 .has_value();
  return count;
}

constexpr int kBlank = 8;  // grey levels

bool is_blank(ImageView picture) {
  std::uint8_t darkest = 255, brightest = 0;
  for (int y = 0; y < picture.height; ++y) {
    const auto [least, most] = std::minmax_element(picture.row(y), picture.row(y) + picture.width);
    darkest = std::min(darkest, *least);
    brightest = std::max(brightest, *most);
  }
  return brightest - darkest < kBlank;
}

}  // namespace

Status check_eyes(const Pair& pair) {
  if (!pair.sees_left() || !pair.sees_right()) return {};
  if (is_blank(pair.picture)) return {};  // a lens cap, or the night
  if (same_picture(pair.left.level(0), pair.right.level(0)))
    return {Reason::NOT_STEREO, "both eyes have the same picture"};
  const int as_given = matches(pair.left, pair.right), exchanged = matches(pair.right, pair.left);
  if (exchanged < kAnyMatches || exchanged < kManyTimes * as_given) return {};
  return {Reason::NOT_STEREO, "the eyes are exchanged: " + std::to_string(exchanged) +
                                  " corners of the right picture lie further to the left in the left one, and " +
                                  std::to_string(as_given) + " the other way round"};
}

}  // namespace relmap
