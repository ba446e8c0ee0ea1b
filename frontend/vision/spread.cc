#include "frontend/vision/spread.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relmap::vision {

namespace {

constexpr int kMinCell = 16;  // pixels; below that a cell is not split

struct Cell {
  float x0, y0, x1, y1;
};

// Keeps chosen points apart: a grid of cells as large as the distance.
class Occupied {
 public:
  Occupied(int width, int height, float distance)
      : distance_(std::max(distance, 1.0F)),
        columns_(static_cast<int>(static_cast<float>(width) / distance_) + 1),
        rows_(static_cast<int>(static_cast<float>(height) / distance_) + 1),
        cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

  bool near(float x, float y) const {
    const int cx = column(x), cy = row(y);
    for (int r = std::max(0, cy - 1); r <= std::min(rows_ - 1, cy + 1); ++r)
      for (int c = std::max(0, cx - 1); c <= std::min(columns_ - 1, cx + 1); ++c)
        for (const PicturePoint& p : cells_[index(c, r)])
          if ((p.x - x) * (p.x - x) + (p.y - y) * (p.y - y) < distance_ * distance_) return true;
    return false;
  }
  void add(float x, float y) { cells_[index(column(x), row(y))].push_back({x, y}); }

 private:
  int column(float x) const { return std::clamp(static_cast<int>(x / distance_), 0, columns_ - 1); }
  int row(float y) const { return std::clamp(static_cast<int>(y / distance_), 0, rows_ - 1); }
  std::size_t index(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c);
  }
  float distance_;
  int columns_, rows_;
  std::vector<std::vector<PicturePoint>> cells_;
};

class QuadTree {
 public:
  QuadTree(std::span<const Corner> candidates, Occupied& occupied) : candidates_(candidates), occupied_(occupied) {}

  std::vector<std::uint32_t> chosen;

  // Fills `cell` up to `wanted` points, `taken` included, and returns how many it then holds. `open` lists its
  // candidates by falling score; those that were used are removed from it.
  int fill(const Cell& cell, int wanted, const std::vector<PicturePoint>& taken, std::vector<std::uint32_t>& open) {
    int have = static_cast<int>(taken.size());
    if (wanted <= have || open.empty()) return have;
    if (wanted <= 1 || cell.x1 - cell.x0 < 2 * kMinCell || cell.y1 - cell.y0 < 2 * kMinCell)
      return have + take(wanted - have, open);

    const float cx = 0.5F * (cell.x0 + cell.x1), cy = 0.5F * (cell.y0 + cell.y1);
    const std::array<Cell, 4> quarters{Cell{cell.x0, cell.y0, cx, cy}, Cell{cx, cell.y0, cell.x1, cy},
                                       Cell{cell.x0, cy, cx, cell.y1}, Cell{cx, cy, cell.x1, cell.y1}};
    std::array<std::vector<PicturePoint>, 4> taken_in;
    std::array<std::vector<std::uint32_t>, 4> open_in;
    const auto quarter = [&](float x, float y) {
      return static_cast<std::size_t>((x >= cx ? 1 : 0) + (y >= cy ? 2 : 0));
    };
    for (const PicturePoint& p : taken) taken_in[quarter(p.x, p.y)].push_back(p);
    for (const std::uint32_t i : open) open_in[quarter(candidates_[i].x, candidates_[i].y)].push_back(i);

    // Quarters with the most taken points go first, so that the share that they do not need goes to the others. What
    // the quarters could not provide is then taken from all remaining candidates.
    std::array<std::size_t, 4> order{0, 1, 2, 3};
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return taken_in[a].size() > taken_in[b].size(); });
    std::array<int, 4> holds{};
    int left = wanted, quarters_left = 4;
    for (const std::size_t q : order) {
      const int share = (left + quarters_left - 1) / quarters_left;
      holds[q] = fill(quarters[q], share, taken_in[q], open_in[q]);
      left -= holds[q];
      --quarters_left;
    }
    open.clear();
    for (const auto& list : open_in) open.insert(open.end(), list.begin(), list.end());
    std::sort(open.begin(), open.end(), [&](std::uint32_t a, std::uint32_t b) { return better(a, b); });
    have = wanted - left;
    return left > 0 ? have + take(left, open) : have;
  }

  bool better(std::uint32_t a, std::uint32_t b) const {
    return candidates_[a].score != candidates_[b].score ? candidates_[a].score > candidates_[b].score : a < b;
  }

 private:
  int take(int count, std::vector<std::uint32_t>& open) {
    int taken = 0;
    std::size_t at = 0;
    for (; at < open.size() && taken < count; ++at) {
      const Corner& corner = candidates_[open[at]];
      if (occupied_.near(corner.x, corner.y)) continue;
      occupied_.add(corner.x, corner.y);
      chosen.push_back(open[at]);
      ++taken;
    }
    open.erase(open.begin(), open.begin() + static_cast<std::ptrdiff_t>(at));
    return taken;
  }

  std::span<const Corner> candidates_;
  Occupied& occupied_;
};

}  // namespace

std::vector<std::uint32_t> choose_spread(std::span<const Corner> candidates, std::span<const PicturePoint> taken,
                                         int width, int height, int wanted, float distance) {
  Occupied occupied(width, height, distance);
  for (const PicturePoint& p : taken) occupied.add(p.x, p.y);
  QuadTree tree(candidates, occupied);
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < candidates.size(); ++i)
    if (!occupied.near(candidates[i].x, candidates[i].y)) open.push_back(i);
  std::sort(open.begin(), open.end(), [&](std::uint32_t a, std::uint32_t b) { return tree.better(a, b); });
  tree.fill({0, 0, static_cast<float>(width), static_cast<float>(height)}, wanted,
            std::vector<PicturePoint>(taken.begin(), taken.end()), open);
  std::sort(tree.chosen.begin(), tree.chosen.end(),
            [&](std::uint32_t a, std::uint32_t b) { return tree.better(a, b); });
  return tree.chosen;
}

}  // namespace relmap::vision
