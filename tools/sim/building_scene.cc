#include "tools/sim/building_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/sim/carrier.h"
#include "tools/sim/painting.h"
#include "tools/sim/scene_builder.h"
#include "tools/sim/street_textures.h"

namespace relmap::sim {
namespace {

constexpr double kCeiling = 2.6;     // metres
constexpr double kModule = 1.5;      // metres of the corridor that have textures of their own, about
constexpr double kExchanged = 0.25;  // of the things of a place that looks like another one

Canvas paint_door(double width, double height, Random& random) {
  const double leaf = random.uniform(30, 210);
  Canvas canvas(width, height, kPropTexels, leaf);
  canvas.frame_rect(0, 0, width, height, 0.07, contrasting(leaf, random));
  const double pane = contrasting(leaf, random);
  canvas.fill_rect(0.2 * width, 0.15 * height, 0.8 * width, height * random.uniform(0.35, 0.5), pane);
  paint_letters(canvas, 0.25 * width, 0.2 * height, 0.5 * width, 0.12, contrasting(pane, random), random);
  paint_composition(canvas, 0.25 * width, height * random.uniform(0.5, 0.6), 0.5 * width, 0.3 * height, random);
  canvas.fill_ellipse(0.88 * width, 0.5 * height, 0.04, 0.04, 230);
  canvas.roughen(0.05, 0.08, random);
  return canvas;
}

Canvas paint_floor(double length, double width, Random& random) {
  Canvas canvas(length, width, kGroundTexels, 120);
  paint_masonry(canvas, 0, 0, length, width, random);
  if (random.chance(0.4))
    paint_composition(canvas, 0.2 * length, width * random.uniform(0.2, 0.4), 0.6 * length, 0.3 * width, random);
  for (int k = static_cast<int>(length * width * 14); k > 0; --k) {  // litter
    const Vector2 at(length * random.uniform(), width * random.uniform());
    const double r = random.uniform(0.012, 0.06), turn = random.uniform(0, M_PI);
    const Vector2 a(r * std::cos(turn), r * std::sin(turn)), b(-0.6 * a.y(), 0.6 * a.x());
    canvas.fill_polygon({at + a, at + b, at - a, at - b},
                        random.chance(0.5) ? random.uniform(10, 55) : random.uniform(170, 240));
  }
  canvas.roughen(0.05, 0.15, random);
  return canvas;
}

Canvas paint_ceiling(double length, double width, Random& random) {
  Canvas canvas(length, width, kWallTexels, 150);
  paint_masonry(canvas, 0, 0, length, width, random);
  const double along = random.uniform(0.1, 0.4) * length, across = random.uniform(0.15, 0.6) * width;
  canvas.fill_rect(along, across, along + 0.5 * length, across + 0.3 * width, 240);
  canvas.frame_rect(along, across, along + 0.5 * length, across + 0.3 * width, 0.04, 30);
  return canvas;
}

class BuildingBuilder : private SceneBuilder {
 public:
  BuildingBuilder(const PictureWorldOptions& options, const Road& road)
      : options_(options),
        road_(road),
        around_(2 * static_cast<int>(std::lround(options.ride_way / kModule / 2))),
        length_(options.ride_way / around_) {}

  Scene build() {
    switch (options_.ride) {
      case RideKind::kLift:
      case RideKind::kLiftAlike:
        for (const int floor : {0, 1})
          for (int k = 0; k < around_; ++k) module(k, floor);
        break;
      case RideKind::kLiftRamp: {  // from behind the lift's lower end to beyond its upper one
        const int beyond = static_cast<int>(std::ceil(3 / length_));
        for (int k = -beyond; k < around_ + beyond; ++k) module(k, 0);
        for (const int end : {-beyond, around_ + beyond}) end_wall(end);
        break;
      }
      default:
        for (int k = 0; k < around_; ++k) module(k, 0);
    }
    return std::move(scene_);
  }

 private:
  // Of a place: what it looks like, and by which copy of that it is (0: the first).
  struct Look {
    std::uint64_t kind;
    int copy;
  };
  Look look(int k, int floor) const {
    const auto place = static_cast<std::uint64_t>(k + around_);  // k may be negative
    if (options_.ride == RideKind::kLiftAlike) return {place, floor};
    if (options_.ride == RideKind::kAlike) return {place % static_cast<std::uint64_t>(around_ / 2), k >= around_ / 2};
    return {place + 1000 * static_cast<std::uint64_t>(floor), 0};
  }

  double floor_height(double way, int floor) const { return road_.height(way) + floor * kStorey; }
  Vector3 at(double way, double offset, double floor_height) const {
    return lift(road_.beside(way, offset), floor_height);
  }

  // Where a lift shaft or an escalator takes the place of the floor.
  bool is_open(int k) const {
    const double begin = k * length_, end = begin + length_;
    const auto overlaps = [&](double from, double to) { return begin < to && end > from; };
    switch (options_.ride) {
      case RideKind::kLift:
      case RideKind::kLiftAlike: {
        const double lift = lift_place(options_);
        return overlaps(lift - kCabinBack, lift + kCabinFront);
      }
      case RideKind::kLiftRamp:
        return overlaps(-kCabinBack, kCabinFront) ||
               overlaps(options_.ride_way - kCabinBack, options_.ride_way + kCabinFront);
      case RideKind::kEscalator: {
        const Slope belt = escalator_place(options_);
        return overlaps(belt.from - kBeltBack, belt.to + kBeltFront);
      }
      default:
        return false;
    }
  }

  void module(int k, int floor) {
    const double begin = k * length_, end = begin + length_;
    const double heights[2] = {floor_height(begin, floor), floor_height(end, floor)};
    const Look seen = look(k, floor);
    Random random(options_.seed, 50, seen.kind);
    const bool open = is_open(k), escalator = options_.ride == RideKind::kEscalator;
    if (!open) slab(begin, end, heights, 0, texture(paint_floor(slab_length(), 2 * kCorridor, random)), kGroundTexels);
    if (!open || escalator)
      slab(begin, end, heights, kCeiling, texture(paint_ceiling(slab_length(), 2 * kCorridor, random)), kWallTexels);
    for (const int side : {-1, 1}) side_wall(k, side, begin, end, heights, seen, open);
  }

  // On the outside of a bend.
  double slab_length() const { return 3 * length_; }

  // Floor or ceiling, in two triangles, since a bend on a slope is not plane.
  void slab(double begin, double end, const double (&heights)[2], double above, int texture_index, double texels) {
    const Vector3 corners[4] = {at(begin, -kCorridor, heights[0] + above), at(begin, kCorridor, heights[0] + above),
                                at(end, kCorridor, heights[1] + above), at(end, -kCorridor, heights[1] + above)};
    const Vector2 middle = road_.beside(0.5 * (begin + end), 0);
    const Vector2 right = (road_.beside(0.5 * (begin + end), 1) - middle).normalized(), ahead(-right.y(), right.x());
    const auto texel = [&](const Vector3& corner) -> Vector2 {
      const Vector2 plan = Vector2(corner.x(), corner.z()) - middle;
      return texels * Vector2(plan.dot(ahead) + 0.5 * slab_length(), plan.dot(right) + kCorridor);
    };
    for (const int other : {1, 2}) {
      const std::array<Vector3, 3> triangle{corners[0], corners[other], corners[other + 1]};
      polygon(triangle, {texel(triangle[0]), texel(triangle[1]), texel(triangle[2])}, texture_index);
    }
  }

  void side_wall(int k, int side, double begin, double end, const double (&heights)[2], const Look& seen, bool open) {
    Random random(options_.seed, 51, seen.kind, static_cast<std::uint64_t>(side + 1));
    // What differs between a place and the one that looks like it.
    Random other(options_.seed, 52, static_cast<std::uint64_t>(k + around_), static_cast<std::uint64_t>(side + 1));
    const bool exchanged = seen.copy > 0 && other.chance(kExchanged);
    const Vector3 from = at(begin, side * kCorridor, heights[0] + kCeiling);
    const Vector3 along = at(end, side * kCorridor, heights[1] + kCeiling) - from;
    const double width = along.norm();
    panel(from, along, Vector3(0, kCeiling, 0), texture(paint_wall(width, kCeiling, kWallTexels, random)), kWallTexels);
    Random& thing = exchanged ? other : random;
    if (width < 0.9) return;
    const Vector3 out = (at(begin, 0, 0) - at(begin, side, 0)).normalized();  // from the wall
    const double wide = std::min(width - 0.1, thing.uniform(0.6, 1.2)), start = thing.uniform(0.05, 1) * (width - wide);
    const Vector3 corner = from + along * (start / width) + 0.04 * out;
    const Vector3 across = along * (wide / width);
    if (thing.chance(0.35)) {
      panel(corner + Vector3(0, kCeiling - 2.05, 0), across, Vector3(0, 2.05, 0),
            texture(paint_door(wide, 2.05, thing)), kPropTexels);
    } else {
      const double tall = thing.uniform(0.7, 1.3);
      panel(corner + Vector3(0, thing.uniform(0.4, 1.0), 0), across, Vector3(0, tall, 0),
            texture(paint_poster(wide, tall, thing)), kPropTexels);
    }
    if (!open && thing.chance(0.4)) stand(0.5 * (begin + end), side, 0.5 * (heights[0] + heights[1]), thing);
  }

  // Something on the floor, at the wall.
  void stand(double way, int side, double height, Random& random) {
    const Vector2 middle = road_.beside(way, side * (kCorridor - 0.2));
    const double tall = random.uniform(0.4, 1.1), turn = random.uniform(-0.3, 0.3);
    if (random.chance(0.5))
      prism(box_plan(middle, 0.32, 0.32, turn), height, height + tall, texture(paint_crates(4 * 0.32, tall, random)),
            kPropTexels);
    else
      prism(round_plan(middle, 0.17, 8), height, height + tall,
            texture(paint_poster_row(2 * M_PI * 0.17, tall, random)), kPropTexels);
  }

  void end_wall(int k) {
    Random random(options_.seed, 53, static_cast<std::uint64_t>(k + around_));
    const double height = floor_height(k * length_, 0);
    wall(road_.beside(k * length_, -kCorridor), road_.beside(k * length_, kCorridor), height + kCeiling, height,
         texture(paint_wall(2 * kCorridor, kCeiling, kWallTexels, random)), kWallTexels);
  }

  const PictureWorldOptions& options_;
  const Road& road_;
  const int around_;     // modules of the corridor, once round
  const double length_;  // of each, metres
};

}  // namespace

Scene build_building(const PictureWorldOptions& options, const Road& road) {
  return BuildingBuilder(options, road).build();
}

}  // namespace relmap::sim
