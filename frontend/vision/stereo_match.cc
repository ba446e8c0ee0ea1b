#include "frontend/vision/stereo_match.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/vision/patch.h"
#include "frontend/vision/template.h"

namespace relmap::vision {

namespace {

constexpr float kRowTolerance = 1.0F;  // pixels of the level, after the alignment

struct Found {
  int x = 0, y = 0;
  int sad = std::numeric_limits<int>::max();
  bool unique = false;
};

// The best place for the centre of `patch`: in columns x_from..x_to, on rows y - rows..y + rows.
Found search_rows(const SadPatch& patch, ImageView image, int y, int rows, int x_from, int x_to, float uniqueness) {
  Found best;
  x_from = std::max(x_from, kPatchRadius);
  x_to = std::min(x_to, image.width - kPatchRadius - 1);
  if (x_from > x_to) return best;
  // The best of the rows for each column; a second best counts only at a distance from the best.
  static thread_local std::vector<int> column_best;
  column_best.assign(static_cast<std::size_t>(x_to - x_from + 1), std::numeric_limits<int>::max());
  for (int row = y - rows; row <= y + rows; ++row) {
    if (row < kPatchRadius || row >= image.height - kPatchRadius) continue;
    for (int x = x_from; x <= x_to; ++x) {
      const int sad = patch.compare(image, x, row);
      int& column = column_best[static_cast<std::size_t>(x - x_from)];
      column = std::min(column, sad);
      if (sad < best.sad) best = {x, row, sad, false};
    }
  }
  int second = std::numeric_limits<int>::max();
  for (int x = x_from; x <= x_to; ++x)
    if (std::abs(x - best.x) > 2) second = std::min(second, column_best[static_cast<std::size_t>(x - x_from)]);
  best.unique = static_cast<float>(best.sad) < uniqueness * static_cast<float>(second);
  return best;
}

std::optional<StereoMatch> align(const Template& patch, const Pyramid& right, float u, float y, float start_x,
                                 float start_y, int level, const StereoMatchOptions& options) {
  const auto aligned = patch.align(right.level(level), start_x, start_y);
  if (!aligned || aligned->correlation < options.min_correlation || std::abs(aligned->y - y) > kRowTolerance)
    return std::nullopt;
  const float disparity = u - from_level(aligned->x, level);
  if (!(disparity >= options.min_disparity && disparity <= options.max_disparity)) return std::nullopt;
  return StereoMatch{disparity, aligned->correlation};
}

}  // namespace

std::optional<StereoMatch> match_stereo(const Pyramid& left, const Pyramid& right, float u, float v, int level,
                                        const StereoMatchOptions& options) {
  if (level < 0 || level >= left.levels() || level >= right.levels()) return std::nullopt;
  const float x = to_level(u, level), y = to_level(v, level);
  const int xi = static_cast<int>(std::lround(x)), yi = static_cast<int>(std::lround(y));
  if (!patch_fits(left.level(level), xi, yi)) return std::nullopt;
  const auto patch = Template::from_image(left.level(level), x, y);
  if (!patch) return std::nullopt;
  const auto scale = static_cast<float>(1 << level);
  const int max_shift = static_cast<int>(std::ceil(options.max_disparity / scale));
  const int min_shift = static_cast<int>(std::floor(options.min_disparity / scale)) - 1;
  const SadPatch mine(left.level(level), xi, yi);
  const Found there =
      search_rows(mine, right.level(level), yi, options.rows, xi - max_shift, xi - min_shift, options.uniqueness);
  if (!there.unique) return std::nullopt;
  const SadPatch theirs(right.level(level), there.x, there.y);
  const Found back =
      search_rows(theirs, left.level(level), there.y, options.rows, there.x + min_shift, there.x + max_shift, 1.0F);
  if (std::abs(back.x - xi) > 1) return std::nullopt;
  return align(*patch, right, u, y, static_cast<float>(there.x) + x - static_cast<float>(xi),
               static_cast<float>(there.y) + y - static_cast<float>(yi), level, options);
}

std::optional<StereoMatch> refine_stereo(const Pyramid& left, const Pyramid& right, float u, float v, int level,
                                         float disparity, const StereoMatchOptions& options) {
  if (level < 0 || level >= left.levels() || level >= right.levels()) return std::nullopt;
  const float x = to_level(u, level), y = to_level(v, level);
  const auto patch = Template::from_image(left.level(level), x, y);
  if (!patch) return std::nullopt;
  // First a search over a few whole pixels either way: the guess may be off by more than the alignment can correct.
  const ImageView image = right.level(level);
  const SadPatch mine = patch->sad();
  const float guess = to_level(u - disparity, level);
  const int yi = static_cast<int>(std::lround(y)), centre = static_cast<int>(std::lround(guess));
  const Found there = search_rows(mine, image, yi, options.rows, centre - 3, centre + 3, 1.0F);
  if (there.sad == std::numeric_limits<int>::max()) return std::nullopt;
  return align(*patch, right, u, y, static_cast<float>(there.x), static_cast<float>(there.y), level, options);
}

}  // namespace relmap::vision
