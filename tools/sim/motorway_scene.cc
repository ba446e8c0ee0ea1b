#include "tools/sim/motorway_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tools/sim/motorway_textures.h"
#include "tools/sim/scene_builder.h"

namespace relmap::sim {
namespace {

constexpr double kRailTop = 0.75, kRailHeight = 0.31, kBarrierHeight = 3.2, kTreeHeight = 14;  // metres
constexpr int kVariants = 5;                                                                   // of what is seen often

class MotorwayBuilder : private SceneBuilder {
 public:
  MotorwayBuilder(const Circuit& circuit, std::uint64_t seed)
      : circuit_(circuit),
        random_(seed, 30),
        pieces_(std::max(1, static_cast<int>(std::lround(circuit.length() / kRoadPiece)))),
        piece_(circuit.length() / pieces_) {}

  Scene build() {
    horizon();
    carriageways();
    for (const double d : {kMedian + 0.4, kMedian - 0.4, kRoadRight + 0.9, 2 * kMedian - kRoadRight - 0.9}) rail(d);
    edge(kRoadRight + 3.5, 1);
    edge(2 * kMedian - kRoadRight - 3.5, -1);
    furniture();
    return std::move(scene_);
  }

 private:
  using Textures = std::array<int, kVariants>;

  template <typename Paint>
  Textures variants(const Paint& paint) {
    Textures out;
    for (int& index : out) index = texture(paint());
    return out;
  }
  int any(const Textures& textures) { return textures[random_.below(kVariants)]; }
  Vector2 at(double s, double d) const { return circuit_.beside(s, d); }
  double start(int k) const { return k * piece_; }

  // Flat on the ground, its texture's left border at d0 and its y along the road.
  void strip(int k, double d0, double d1, int texture_index, double texels) {
    const std::array<Vector3, 4> corners{lift(at(start(k), d0), 0), lift(at(start(k), d1), 0),
                                         lift(at(start(k + 1), d1), 0), lift(at(start(k + 1), d0), 0)};
    const double width = std::abs(d1 - d0) * texels;
    polygon(corners, {Vector2(0, 0), Vector2(width, 0), Vector2(width, kRoadPiece * texels)}, texture_index);
  }

  void carriageways() {
    const Textures road = variants([&] { return paint_motorway(random_); });
    const double wide = 14;
    const Textures grass = variants([&] { return paint_verge(wide, random_); });
    for (int k = 0; k < pieces_; ++k) {
      strip(k, kRoadLeft, kRoadRight, any(road), kRoadTexels);
      strip(k, 2 * kMedian - kRoadLeft, 2 * kMedian - kRoadRight, any(road), kRoadTexels);
      strip(k, kRoadLeft, 2 * kMedian - kRoadLeft, any(grass), kVergeTexels);
      strip(k, kRoadRight, kRoadRight + wide, any(grass), kVergeTexels);
      strip(k, 2 * kMedian - kRoadRight, 2 * kMedian - kRoadRight - wide, any(grass), kVergeTexels);
    }
  }

  void rail(double d) {
    const Textures beam = variants([&] { return paint_rail(kRailHeight, random_); });
    const int steel = texture(Canvas(0.2, kRailTop, kRailTexels, 95));
    for (int k = 0; k < pieces_; ++k) {
      wall(at(start(k), d), at(start(k + 1), d), kRailTop, kRailTop - kRailHeight, any(beam), kRailTexels);
      for (int post = 0; post < 3; ++post) {  // one every 4 m
        const double s = start(k) + (post + 0.5) * piece_ / 3;
        wall(at(s, d - 0.07), at(s, d + 0.07), kRailTop - 0.05, 0, steel, kRailTexels);
        wall(at(s - 0.05, d), at(s + 0.05, d), kRailTop - kRailHeight, 0, steel, kRailTexels);
      }
    }
  }

  // The border of the motorway on one side: stretches of plain barriers, and of verges with trees further away.
  void edge(double d, int side) {
    const Textures barrier = variants([&] { return paint_barrier(kBarrierHeight, random_); });
    const Textures trees = variants([&] { return paint_tree_line(kRoadPiece, kTreeHeight, random_); });
    bool walled = random_.chance(0.5);
    double height = 8, off = 30;
    for (int k = 0, left = 0; k < pieces_; ++k, --left) {
      if (left == 0) {
        walled = !walled;
        left = 10 + random_.below(20);
        off = random_.uniform(18, 45);
        height = 2;
      }
      if (walled) {
        wall(at(start(k), d), at(start(k + 1), d), kBarrierHeight, 0, any(barrier), kVergeTexels);
        continue;
      }
      const int leaves = any(trees);
      for (int part = 0; part < 4; ++part) {
        const double next = left == 1 ? height - 0.2 * height * (part + 1)
                                      : std::clamp(height + random_.uniform(-1.3, 1.6), 2.0, kTreeHeight - 1);
        const double s0 = start(k) + part * piece_ / 4, s1 = s0 + piece_ / 4;
        skyline(at(s0, d + side * off), at(s1, d + side * off), height, next, leaves, kTreeTexels,
                part * kRoadPiece / 4, kTreeHeight);
        height = next;
      }
    }
  }

  // A wall whose top rises or falls; the texture reaches up to `top`.
  void skyline(const Vector2& from, const Vector2& to, double height_from, double height_to, int texture_index,
               double texels, double left, double top) {
    const std::array<Vector3, 4> corners{lift(from, height_from), lift(to, height_to), lift(to, 0), lift(from, 0)};
    const double right = left + (to - from).norm();
    polygon(corners,
            {texels * Vector2(left, top - height_from), texels * Vector2(right, top - height_to),
             texels * Vector2(right, top)},
            texture_index);
  }

  // Sky, two rows of hills and the fields before them, round the whole circuit.
  void horizon() {
    Vector2 middle(0, 0);
    double reach = 0;
    for (int k = 0; k < pieces_; ++k) middle += at(start(k), 0) / pieces_;
    for (int k = 0; k < pieces_; ++k) reach = std::max(reach, (at(start(k), 0) - middle).norm());
    ring(middle, reach + 320, 160, 12, 22, 84);
    ring(middle, reach + 800, 90, 35, 80, 128);
    constexpr int kSides = 32;
    const double far = reach + 1500, high = 1000, side = 2 * far * std::sin(M_PI / kSides);
    const int sky = texture(paint_pale_sky(kSides * side, high, random_));
    const std::vector<Vector2> plan = shifted(round_plan({0, 0}, far, kSides), middle);
    for (int k = 0; k < kSides; ++k) {
      wall(plan[k], plan[(k + 1) % kSides], high, -5, sky, kSkyTexels, k * side);
      scene_.surfaces.back().gain = 1;
    }
    const int fields = texture(paint_fields(2 * far, 2 * far, random_));
    const Vector3 corner = lift(middle - Vector2(far, far), -0.1);
    panel(corner, Vector3(2 * far, 0, 0), Vector3(0, 0, 2 * far), fields, kFieldTexels);
  }

  static std::vector<Vector2> shifted(std::vector<Vector2> plan, const Vector2& by) {
    for (Vector2& p : plan) p += by;
    return plan;
  }

  void ring(const Vector2& middle, double radius, int corners, double lowest, double highest, double value) {
    const double side = 2 * M_PI * radius / corners;
    const Textures slope = variants([&] { return paint_hills(side, highest, value, random_); });
    const std::vector<Vector2> plan = shifted(round_plan({0, 0}, radius, corners), middle);
    double height = 0.5 * (lowest + highest);
    const double first = height, swing = 0.2 * (highest - lowest);
    for (int k = 0; k < corners; ++k) {
      const double next =
          k + 1 == corners ? first : std::clamp(height + random_.uniform(-swing, swing), lowest, highest);
      skyline(plan[k], plan[(k + 1) % corners], height, next, any(slope), kHillTexels, 0, highest);
      scene_.surfaces.back().gain = 1;
      height = next;
    }
  }

  // Signs, gantries, bridges.
  void furniture() {
    const Textures plates = variants([&] { return paint_road_sign(3.2, 2.4, random_); });
    const int concrete = texture(paint_concrete(40, 6, random_)), steel = texture(Canvas(1, 8, kRailTexels, 120));
    for (double s = random_.uniform(60, 160); s < circuit_.length() - 60; s += random_.uniform(140, 320)) {
      switch (random_.below(6)) {
        case 0:
          bridge(s, concrete);
          break;
        case 1:
          gantry(s, plates, steel);
          break;
        default:
          sign(s, any(plates), steel);
      }
    }
  }

  double heading(double s) const {
    const Vector2 direction = circuit_.direction(s);
    return std::atan2(direction.y(), direction.x());
  }

  void sign(double s, int plate, int steel) {
    const double d = kRoadRight + 1.6, foot = random_.uniform(1.2, 2.2), width = random_.uniform(1, 3.2);
    wall(at(s, d), at(s, d + width), foot + 0.75 * width, foot, plate, kSignTexels);
    for (const double leg : {0.2, 0.8})
      prism(box_plan(at(s + 0.1, d + leg * width), 0.12, 0.12, heading(s)), 0, foot + 0.5, steel, kRailTexels);
  }

  void gantry(double s, const Textures& plates, int steel) {
    const double left = kMedian, right = kRoadRight + 1.4;
    for (const double d : {left, right}) prism(box_plan(at(s, d), 0.4, 0.4, heading(s)), 0, 6.6, steel, kRailTexels);
    prism(box_plan(at(s, (left + right) / 2), 0.4, right - left, heading(s)), 6.0, 6.6, steel, kRailTexels);
    for (const double d : {-kLaneWidth, kLaneWidth})
      wall(at(s - 0.3, d - 1.6), at(s - 0.3, d + 1.6), 7.4, 5.2, any(plates), kSignTexels);
  }

  void bridge(double s, int concrete) {
    const double right = kRoadRight + 8, left = 2 * kMedian - right, deck = random_.uniform(5, 11);
    prism(box_plan(at(s, kMedian), deck, right - left, heading(s)), 5.2, 7.2, concrete, kVergeTexels);
    prism(box_plan(at(s, kMedian), 0.7 * deck, 0.9, heading(s)), 0, 5.2, concrete, kVergeTexels);
    for (const double d : {left + 1, right - 1})
      prism(box_plan(at(s, d), deck, 2, heading(s)), 0, 5.2, concrete, kVergeTexels);
  }

  const Circuit& circuit_;
  Random random_;
  int pieces_;
  double piece_;  // metres, near kRoadPiece
};

}  // namespace

Circuit motorway_circuit(std::uint64_t seed, double length_m) {
  CircuitShape shape;
  shape.samples = 1 << 17;
  const double bent = std::clamp((length_m - 650) / 850, 0.0, 1.0);
  const double range[3][2] = {{0.03, 0.06}, {0.01, 0.02}, {0.003, 0.006}};
  for (int k = 0; k < 3; ++k)
    for (int end = 0; end < 2; ++end) shape.amplitude[k][end] = bent * range[k][end];
  return {seed, length_m, shape};
}

Scene build_motorway(const Circuit& circuit, std::uint64_t seed) { return MotorwayBuilder(circuit, seed).build(); }

}  // namespace relmap::sim
