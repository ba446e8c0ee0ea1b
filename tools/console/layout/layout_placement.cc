#include "tools/console/layout/layout_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace relmap::console {
namespace {

constexpr double kLeastGap = 2, kMostGap = 50;  // metres between parts
constexpr double kSparse = 6;                   // the whole, in areas of its parts with their gaps

LayoutBox grown(const LayoutBox& box, double by) {
  return {box.low - Vector2::Constant(by), box.high + Vector2::Constant(by)};
}
bool overlap(const LayoutBox& x, const LayoutBox& y) {
  return x.low.x() < y.high.x() && y.low.x() < x.high.x() && x.low.y() < y.high.y() && y.low.y() < x.high.y();
}
LayoutBox joined(const LayoutBox& x, const LayoutBox& y) { return {x.low.cwiseMin(y.low), x.high.cwiseMax(y.high)}; }
double area(const LayoutBox& box) { return box.size().x() * box.size().y(); }

double gap_of(const std::vector<PlacedPart>& parts) {
  double extent = 0;
  for (const PlacedPart& part : parts) extent = std::max(extent, part.box.size().maxCoeff());
  return std::clamp(0.05 * extent, kLeastGap, kMostGap);
}

// Puts the parts that are not kept in rows below those that are.
void fill_rows(std::vector<PlacedPart>& parts, double gap) {
  std::optional<LayoutBox> all;
  double waiting = 0, widest = 0;
  for (const PlacedPart& part : parts) {
    if (part.kept) {
      all = all ? joined(*all, part.box) : part.box;
    } else {
      waiting += area(grown(part.box, gap / 2));
      widest = std::max(widest, part.box.size().x());
    }
  }
  const bool none = !all;
  if (none) all = LayoutBox();
  const double width = std::max({all->size().x(), widest, 1.2 * std::sqrt(waiting)});
  Vector2 at(all->low.x(), none ? 0 : all->low.y() - gap);  // the upper left corner of the next box
  double row = 0;                                           // its height
  for (PlacedPart& part : parts) {
    if (part.kept) continue;
    const Vector2 size = part.box.size();
    if (row > 0 && at.x() + size.x() > all->low.x() + width) {
      at = {all->low.x(), at.y() - row - gap};
      row = 0;
    }
    part.box = {{at.x(), at.y() - size.y()}, {at.x() + size.x(), at.y()}};
    at.x() += size.x() + gap;
    row = std::max(row, size.y());
  }
}

}  // namespace

void PlaneFit::add(const Vector2& from, const Vector2& to, double heading_from, double heading_to) {
  if (pairs_++ == 0) {
    first_from_ = from;
    first_to_ = to;
    turn_ = heading_to - heading_from;
  }
  const Vector2 f = from - first_from_, t = to - first_to_;
  from_ += f;
  to_ += t;
  dot_ += f.dot(t);
  cross_ += f.x() * t.y() - f.y() * t.x();
}

PlaneMotion PlaneFit::motion() const {
  PlaneMotion motion;
  if (pairs_ == 0) return motion;
  const double n = static_cast<double>(pairs_);
  const Vector2 from = from_ / n, to = to_ / n;
  const double dot = dot_ - n * from.dot(to), cross = cross_ - n * (from.x() * to.y() - from.y() * to.x());
  const double turn = std::hypot(dot, cross) > 1e-6 * n ? std::atan2(cross, dot) : turn_;
  motion.cosine = std::cos(turn);
  motion.sine = std::sin(turn);
  motion.shift = first_to_ + to - motion.turned(first_from_ + from);
  return motion;
}

PlaneMotion lowest_turn(const std::vector<Vector2>& points) {
  constexpr std::size_t kLooked = 2000;
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kLooked);
  PlaneMotion best;
  double lowest = std::numeric_limits<double>::infinity();
  for (int degrees = 0; degrees < 180; degrees += 2) {
    PlaneMotion motion;
    motion.cosine = std::cos(degrees * std::numbers::pi / 180);
    motion.sine = std::sin(degrees * std::numbers::pi / 180);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t k = 0; k < points.size(); k += stride) {
      const double y = motion.turned(points[k]).y();
      low = std::min(low, y);
      high = std::max(high, y);
    }
    if (high - low < lowest * (1 - 1e-9)) {
      lowest = high - low;
      best = motion;
    }
  }
  return best;
}

void place_parts(std::vector<PlacedPart>& parts) {
  const double gap = gap_of(parts);
  std::vector<LayoutBox> taken;
  std::optional<LayoutBox> all;
  double needed = 0;
  for (PlacedPart& part : parts) {
    needed += area(grown(part.box, gap / 2));
    if (!part.kept) continue;
    const LayoutBox box = grown(part.box, gap / 8);
    part.kept = std::none_of(taken.begin(), taken.end(), [&](const LayoutBox& other) { return overlap(box, other); });
    if (!part.kept) continue;
    taken.push_back(box);
    all = all ? joined(*all, part.box) : part.box;
  }
  if (all && area(*all) > kSparse * needed) {
    bool first = true;
    for (PlacedPart& part : parts) {
      part.kept = part.kept && first;
      if (part.kept) first = false;
    }
  }
  fill_rows(parts, gap);
}

WorldSquare world_around(const LayoutBox& all, const std::optional<WorldSquare>& before) {
  constexpr double kLeast = 16;
  const double extent = all.size().maxCoeff();
  if (before) {
    const Vector2 far = before->corner + Vector2::Constant(before->size);
    const bool holds = (all.low.array() >= before->corner.array()).all() && (all.high.array() <= far.array()).all();
    if (holds && (before->size <= kLeast || extent > before->size / 5)) return *before;
  }
  WorldSquare world;
  world.size = kLeast;
  while (world.size < 1.05 * extent + 1) world.size *= 2;
  world.corner = (all.low + all.high) / 2 - Vector2::Constant(world.size / 2);
  return world;
}

}  // namespace relmap::console
