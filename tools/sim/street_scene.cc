#include "tools/sim/street_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/sim/scene_builder.h"
#include "tools/sim/street_textures.h"

namespace relmap::sim {
namespace {

class StreetBuilder : private SceneBuilder {
 public:
  StreetBuilder(const Circuit& circuit, std::uint64_t seed) : circuit_(circuit), random_(seed, 2), seed_(seed) {}

  Scene build() {
    ground_and_sky();
    const double room = circuit_.min_radius();
    row_of_houses(circuit_.inner_side(), std::min(3.0, 0.5 * room), std::min(4.3, 0.65 * room));
    row_of_houses(-circuit_.inner_side(), 3.6, 5.6);
    pavement(circuit_.inner_side(), 0.6 * room);
    pavement(-circuit_.inner_side(), 3.4);
    banners();
    return std::move(scene_);
  }

 private:
  void ground_and_sky() {
    Vector2 low(1e9, 1e9), high(-1e9, -1e9);
    for (double s = 0; s < circuit_.length(); s += 0.5) {
      low = low.cwiseMin(circuit_.point(s));
      high = high.cwiseMax(circuit_.point(s));
    }
    low.array() -= 7;
    high.array() += 7;
    const Vector2 size = high - low;
    Random paint(seed_, 3);
    const int ground = texture(paint_ground(circuit_, low, size.x(), size.y(), paint));
    panel(lift(low, 0), Vector3(size.x(), 0, 0), Vector3(0, 0, size.y()), ground, kGroundTexels);
    const double far = 200;
    const int clouds = texture(paint_clouds(2 * far, 2 * far, paint));
    const Vector2 sky[4] = {{-far, -far}, {far, -far}, {far, far}, {-far, far}};
    for (int k = 0; k < 4; ++k) wall(sky[k], sky[(k + 1) % 4], 2 * far, 0, clouds, 1);
    panel(lift(sky[0], 2 * far), Vector3(2 * far, 0, 0), Vector3(0, 0, 2 * far), clouds, 1);
  }

  void row_of_houses(int side, double min_offset, double max_offset) {
    const double stretch =
        1 - side * circuit_.inner_side() * 0.5 * (min_offset + max_offset) * 2 * M_PI / circuit_.length();
    std::vector<double> ends{0}, offsets;
    while (circuit_.length() - ends.back() > 1e-6) {
      double next = ends.back() + random_.uniform(4.0, 7.5) / std::max(0.4, stretch);
      if (next > circuit_.length() - 2.5) next = circuit_.length();
      ends.push_back(next);
      offsets.push_back(random_.uniform(min_offset, max_offset));
    }
    double previous_height = 7;
    for (std::size_t k = 0; k < offsets.size(); ++k) {
      const double d = side * offsets[k], height = random_.uniform(6.0, 9.5);
      const Vector2 from = circuit_.beside(ends[k], d), to = circuit_.beside(ends[k + 1], d);
      Random paint = random_;
      random_.bits();
      wall(from, to, height, 0, texture(paint_facade((to - from).norm(), height, paint)), kWallTexels);
      const Vector2 corner = circuit_.beside(ends[k], side * offsets[k == 0 ? offsets.size() - 1 : k - 1]);
      const double step_height = std::max(height, k == 0 ? 9.5 : previous_height);
      const double step = (corner - from).norm();
      if (step > 0.02)
        wall(corner, from, step_height, 0, texture(paint_wall(step, step_height, kWallTexels, random_)), kWallTexels);
      relief(from, to, side, height);
      previous_height = height;
    }
  }

  // Things that stand out from a house front.
  void relief(const Vector2& from, const Vector2& to, int side, double height) {
    const Vector2 along = (to - from).normalized();
    const Vector2 out = side * Vector2(-along.y(), along.x());  // towards the road
    const double width = (to - from).norm(), turn = std::atan2(along.y(), along.x());
    if (random_.chance(0.6)) {
      const double size = random_.uniform(0.3, 0.6);
      prism(box_plan(from + along * size / 2, size, size, turn), 0, height + 0.3,
            texture(paint_wall(4 * size, height + 0.3, kWallTexels, random_)), kWallTexels);
    }
    for (int k = random_.below(3); k > 0; --k) {  // signs that hang out over the pavement
      const double length = random_.uniform(0.4, 0.8), tall = random_.uniform(0.5, 1.0),
                   at = random_.uniform(0.5, width);
      const double foot = random_.uniform(2.2, 3.6);
      prism(box_plan(from + along * at + out * (0.1 + length / 2), 0.08, length, turn), foot, foot + tall,
            texture(paint_poster_row(2 * (0.08 + length), tall, random_)), kPropTexels);
    }
    if (random_.chance(0.5)) {  // a bay
      const double bay = std::min(random_.uniform(1.2, 2.4), 0.8 * width), deep = random_.uniform(0.4, 0.8);
      const double foot = random_.uniform(2.3, 2.8), top = foot + random_.uniform(1.2, 2.4);
      prism(box_plan(from + along * width * random_.uniform(0.3, 0.7) + out * deep / 2, bay, deep, turn), foot, top,
            texture(paint_wall(2 * (bay + deep), top - foot, kWallTexels, random_)), kWallTexels);
    }
  }

  // `limit`: how far from the road's middle there is room.
  void pavement(int side, double limit) {
    for (double s = random_.uniform(0, 2); s < circuit_.length() - 1; s += random_.uniform(1.3, 3.2)) {
      const double d = random_.uniform(1.7, 2.7);
      if (d + 0.5 > limit) continue;
      thing(circuit_.beside(s, side * d), circuit_.direction(s));
    }
  }

  void thing(const Vector2& at, const Vector2& heading) {
    const double turn = std::atan2(heading.y(), heading.x());
    switch (random_.below(8)) {
      case 0:
      case 1: {  // crates
        double foot = 0;
        for (int k = 1 + random_.below(3); k > 0; --k) {
          const double size = random_.uniform(0.4, 0.75), tall = random_.uniform(0.3, 0.6);
          const Vector2 middle = at + 0.1 * Vector2(random_.uniform(-1, 1), random_.uniform(-1, 1));
          prism(box_plan(middle, size, size, turn + random_.uniform(-0.6, 0.6)), foot, foot + tall,
                texture(paint_crates(4 * size, tall, random_)), kPropTexels);
          foot += tall;
        }
        break;
      }
      case 2: {  // a column of posters
        const double radius = random_.uniform(0.25, 0.42), tall = random_.uniform(1.6, 2.6);
        prism(round_plan(at, radius, 12), 0, tall, texture(paint_poster_row(2 * M_PI * radius, tall, random_)),
              kPropTexels);
        break;
      }
      case 3:
      case 4: {  // a board on two legs, turned towards those who come
        const double width = random_.uniform(0.7, 1.1), foot = random_.uniform(0.5, 0.9),
                     tall = random_.uniform(0.7, 1.3);
        const double facing = turn + M_PI / 2 + random_.uniform(-0.7, 0.7);
        const Vector2 across(std::cos(facing) * width / 2, std::sin(facing) * width / 2);
        const int legs = texture(paint_bark(0.3, foot + tall, random_));
        for (const double end : {-0.85, 0.85})
          prism(box_plan(at + end * across, 0.07, 0.07, facing), 0, foot, legs, kPropTexels);
        prism(box_plan(at, width, 0.06, facing), foot, foot + tall,
              texture(paint_poster_row(2 * (width + 0.06), tall, random_)), kPropTexels);
        break;
      }
      case 5: {  // a lamp post with a plate
        prism(round_plan(at, 0.07, 6), 0, 5, texture(paint_bark(0.45, 5, random_)), kPropTexels);
        const double plate = random_.uniform(0.35, 0.6), foot = random_.uniform(1.5, 2.4);
        prism(box_plan(at - 0.09 * heading, plate, 0.03, turn + M_PI / 2), foot, foot + plate,
              texture(paint_poster_row(2 * (plate + 0.03), plate, random_)), kPropTexels);
        break;
      }
      case 6: {  // a tree
        const double trunk = random_.uniform(1.9, 2.6), crown = random_.uniform(0.7, 1.1);
        prism(round_plan(at, random_.uniform(0.09, 0.18), 7), 0, trunk + 0.3,
              texture(paint_bark(1.2, trunk + 0.3, random_)), kPropTexels);
        foliage(lift(at, trunk + crown), crown, crown * random_.uniform(1.0, 1.4));
        break;
      }
      default: {  // a planter with a bush
        const double width = random_.uniform(0.6, 0.9), tall = random_.uniform(0.35, 0.6);
        prism(box_plan(at, width, 0.5, turn), 0, tall, texture(paint_crates(2 * (width + 0.5), tall, random_)),
              kPropTexels);
        foliage(lift(at, tall + 0.3), width * 0.5, random_.uniform(0.35, 0.6));
      }
    }
  }

  void foliage(const Vector3& middle, double radius, double half_height) {
    constexpr int kRound = 8, kUp = 5;
    const int leaves = texture(paint_foliage(2 * M_PI * radius, M_PI * half_height, random_));
    std::array<std::array<Vector3, kRound>, kUp + 1> grid;
    for (int j = 0; j <= kUp; ++j)
      for (int i = 0; i < kRound; ++i) {
        const double up = M_PI * j / kUp, round = 2 * M_PI * i / kRound;
        const double bulge = j == 0 || j == kUp ? 1 : random_.uniform(0.8, 1.15);
        grid[j][i] = middle + bulge * Vector3(radius * std::sin(up) * std::cos(round), -half_height * std::cos(up),
                                              radius * std::sin(up) * std::sin(round));
      }
    const auto texel = [&](int j, int i) -> Vector2 {
      return 80 * Vector2(2 * M_PI * radius * i / kRound, M_PI * half_height * j / kUp);
    };
    for (int j = 0; j < kUp; ++j)
      for (int i = 0; i < kRound; ++i) {
        const int next = (i + 1) % kRound;
        const std::array<Vector3, 3> upper{grid[j][i], grid[j + 1][i], grid[j + 1][next]};
        const std::array<Vector3, 3> lower{grid[j][i], grid[j + 1][next], grid[j][next]};
        if (j < kUp - 1) polygon(upper, {texel(j, i), texel(j + 1, i), texel(j + 1, i + 1)}, leaves);
        if (j > 0) polygon(lower, {texel(j, i), texel(j + 1, i + 1), texel(j, i + 1)}, leaves);
      }
  }

  void banners() {
    for (double s = random_.uniform(3, 8); s < circuit_.length() - 2; s += random_.uniform(7, 14)) {
      const double foot = random_.uniform(2.9, 3.6), tall = random_.uniform(0.5, 0.9);
      const double reach = std::min(2.6, 0.5 * circuit_.min_radius());
      const Vector2 left = circuit_.beside(s, -reach), right = circuit_.beside(s, reach);
      wall(left, right, foot + tall, foot, texture(paint_poster_row((right - left).norm(), tall, random_)),
           kPropTexels);
    }
  }

  const Circuit& circuit_;
  Random random_;
  std::uint64_t seed_;
};

}  // namespace

Scene build_street(const Circuit& circuit, std::uint64_t seed) { return StreetBuilder(circuit, seed).build(); }

}  // namespace relmap::sim
