#include "frontend/vision/sharpness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "proto/base/quantile.h"

namespace relmap::vision {

namespace {

constexpr int kReach = 24;        // pixels from the steepest place of an edge to its end
constexpr int kMinContrast = 24;  // grey levels: well above the noise
constexpr std::size_t kMinEdges = 50;

// A row or a column.
struct Line {
  const std::uint8_t* data;
  std::ptrdiff_t step;
  int length;
  int operator[](int i) const { return data[i * step]; }
  int slope(int i) const { return (*this)[i + 1] - (*this)[i - 1]; }  // grey levels over two pixels
};

// The contrast of a strong edge: a quarter of the range between the 2nd and the 98th percentile of grey levels.
int strong_contrast(ImageView picture) {
  std::array<int, 256> histogram{};
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) ++histogram[picture.at(x, y)];
  const int tail = picture.width * picture.height / 50;
  int low = 0, high = 255;
  for (int below = histogram[0]; below <= tail && low < 255; below += histogram[static_cast<std::size_t>(++low)]) {
  }
  for (int above = histogram[255]; above <= tail && high > 0; above += histogram[static_cast<std::size_t>(--high)]) {
  }
  return std::max(kMinContrast, (high - low) / 4);
}

struct EdgeEnd {
  int value;
  int steepest;  // largest slope on the way
};

// Follows the edge that rises (falls, with sign -1) from i in `direction` to its end: the last extremum before the
// value goes back by more than noise (`tolerance`).
EdgeEnd end_of_edge(const Line& line, int i, int direction, int sign, int tolerance) {
  int extremum = sign * line[i], steepest = 0, on_the_way = 0;
  for (int n = 0; n < kReach; ++n) {
    i += direction;
    if (i < 1 || i >= line.length - 1)
      return {sign > 0 ? 255 : 0, 0};  // the border cuts it off, as white or black does
    const int value = sign * line[i];
    if (value < extremum - tolerance) break;
    on_the_way = std::max(on_the_way, std::abs(line.slope(i)));
    if (value > extremum) extremum = value, steepest = on_the_way;
  }
  return {sign * extremum, steepest};
}

void collect(const Line& line, int strong, std::vector<float>& widths) {
  const int tolerance = strong / 4;
  for (int i = 2; i < line.length - 2; ++i) {
    const int slope = std::abs(line.slope(i));
    // A strong edge that is no wider than kReach has at least this slope.
    if (slope * kReach < strong || slope < std::abs(line.slope(i - 1)) || slope <= std::abs(line.slope(i + 1)))
      continue;
    const int upward = line.slope(i) > 0 ? 1 : -1;
    const EdgeEnd high = end_of_edge(line, i, upward, 1, tolerance), low = end_of_edge(line, i, -upward, -1, tolerance);
    const int contrast = high.value - low.value;
    if (contrast < strong || high.value >= kWhite || low.value <= kBlack) continue;
    if (std::max(high.steepest, low.steepest) > slope) continue;  // it is counted where it is steepest
    widths.push_back(2 * static_cast<float>(contrast) / static_cast<float>(slope));
  }
}

}  // namespace

std::optional<double> edge_width(ImageView picture) {
  if (picture.empty()) return std::nullopt;
  const int strong = strong_contrast(picture);
  std::vector<float> widths;
  for (int y = 0; y < picture.height; y += 2) collect({picture.row(y), 1, picture.width}, strong, widths);
  for (int x = 0; x < picture.width; x += 2)
    collect({picture.data + x, picture.stride, picture.height}, strong, widths);
  if (widths.size() < kMinEdges) return std::nullopt;
  const std::size_t fifth = widths.size() / 5;
  return ranked(std::move(widths), fifth);
}

}  // namespace relmap::vision
