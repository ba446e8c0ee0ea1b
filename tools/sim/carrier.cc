#include "tools/sim/carrier.h"

#include <array>
#include <cmath>
#include <utility>

#include "tools/sim/street_textures.h"

namespace relmap::sim {
namespace {

constexpr double kHalfWidth = 1.0, kLiftHeight = 2.1;                                     // metres, of cabins
constexpr double kWagonBack = 1.5, kWagonFront = 2.5, kWagonHeight = 2.0, kHeader = 0.3;  // likewise
constexpr double kTread = 0.4, kStepHalfWidth = 1.3, kRiser = 0.3, kPanel = 2.0;          // of the escalator
constexpr int kSteps = 40;  // until their textures come again: more than there are in sight

class PartBuilder {
 public:
  explicit PartBuilder(Scene& scene) : scene_(scene) {}

  // `corner`: its texture's top left one.
  void panel(const Vector3& corner, const Vector3& across, const Vector3& down, const Canvas& canvas) {
    scene_.textures.emplace_back(canvas);
    const std::array<Vector3, 4> corners{corner, corner + across, corner + across + down, corner + down};
    const double w = across.norm() * canvas.texels_per_metre(), h = down.norm() * canvas.texels_per_metre();
    part_.push_back(make_surface(corners, {Vector2(0, 0), Vector2(w, 0), Vector2(w, h)},
                                 static_cast<int>(scene_.textures.size()) - 1));
  }
  void posters(const Vector3& corner, const Vector3& across, const Vector3& down, Random& random) {
    panel(corner, across, down, paint_poster_row(across.norm(), down.norm(), random));
  }
  void plain(const Vector3& corner, const Vector3& across, const Vector3& down, Random& random) {
    panel(corner, across, down, paint_wall(across.norm(), down.norm(), kPropTexels, random));
  }
  // Without its foot and its back.
  void box(const Vector3& low, const Vector3& size, Random& random) {
    const Vector3 x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z()), top = low - y;
    for (const Vector3& side : {Vector3(0, 0, 0), x}) panel(top + side, z, y, paint_crates(size.z(), size.y(), random));
    panel(top, x, y, paint_crates(size.x(), size.y(), random));
    panel(top, x, z, paint_crates(size.x(), size.z(), random));
  }
  std::vector<Surface> take() { return std::move(part_); }

 private:
  Scene& scene_;
  std::vector<Surface> part_;
};

// Floor, roof and both side walls.
void tunnel(PartBuilder& out, double back, double front, double height, Random& random) {
  const Vector3 along(0, 0, back + front), across(2 * kHalfWidth, 0, 0), down(0, height, 0);
  const Vector3 corner(-kHalfWidth, -height, -back);
  out.plain(corner + down - Vector3(0, 0.02, 0), across, along, random);
  out.plain(corner, across, along, random);
  out.posters(corner, along, down, random);
  out.posters(corner + across, along, down, random);
}

}  // namespace

Carrier::Carrier(const PictureWorldOptions& options, const Itinerary& itinerary, const Road& road, Scene& scene,
                 Random random)
    : kind_(options.ride), belt_(escalator_place(options)), itinerary_(itinerary), road_(road) {
  if (kind_ == RideKind::kTrain)
    build_wagon(scene, random);
  else if (kind_ == RideKind::kEscalator)
    build_steps(scene, random);
  else
    build_lift(scene, random);
}

void Carrier::build_lift(Scene& scene, Random& random) {
  PartBuilder cabin(scene);
  tunnel(cabin, kCabinBack, kCabinFront, kLiftHeight, random);
  parts_.push_back(cabin.take());
  for (const double left : {-kHalfWidth, 0.0}) {
    PartBuilder leaf(scene);
    leaf.posters({left, -kLiftHeight, kCabinFront}, {kHalfWidth, 0, 0}, {0, kLiftHeight, 0}, random);
    parts_.push_back(leaf.take());
  }
}

void Carrier::build_wagon(Scene& scene, Random& random) {
  PartBuilder wagon(scene);
  tunnel(wagon, kWagonBack, kWagonFront, kWagonHeight, random);
  wagon.posters({-kHalfWidth, -kWagonHeight, kWagonFront}, {2 * kHalfWidth, 0, 0}, {0, kHeader, 0}, random);
  for (const double side : {-kHalfWidth, kHalfWidth - 0.25}) {
    wagon.box({side, 0, 0.8}, {0.25, 0.5, 0.5}, random);
    wagon.box({side, 0, 1.7}, {0.25, 0.9, 0.5}, random);
  }
  parts_.push_back(wagon.take());
}

// A step: the riser in front, the tread behind it, walls on both sides.
void Carrier::build_steps(Scene& scene, Random& random) {
  for (int k = 0; k < kSteps; ++k) {
    PartBuilder step(scene);
    const Vector3 left(-kStepHalfWidth, 0, 0), across(2 * kStepHalfWidth, 0, 0), along(0, 0, kTread);
    step.panel(left, across, {0, kRiser, 0}, paint_crates(across.norm(), kRiser, random));
    step.panel(left, across, along, paint_crates(across.norm(), kTread, random));
    for (const Vector3& side : {left, Vector3(-left)})
      step.posters(side - Vector3(0, kPanel, 0), along, {0, kPanel + kRiser, 0}, random);
    parts_.push_back(step.take());
  }
}

std::vector<Surface> Carrier::placed(double seconds, double later) const {
  const Itinerary::State now = itinerary_.at(seconds), state = itinerary_.at(seconds + later);
  std::vector<Surface> out;
  const auto place = [&](const Part& part, const SE3& T_world_part) {
    for (const Surface& surface : part) out.push_back(moved(surface, T_world_part));
  };
  if (kind_ == RideKind::kEscalator) {
    const double board = itinerary_.rides().front().board, belt = now.carrier_way - board;
    const auto first = static_cast<int>(std::ceil((belt_.from - kBeltBack - belt) / kTread));
    const auto last = static_cast<int>(std::floor((belt_.to + kBeltFront - kTread - belt) / kTread));
    for (int k = first; k <= last; ++k)
      place(parts_[static_cast<std::size_t>(k % kSteps)], road_.T_world_road(k * kTread + state.carrier_way - board));
    return out;
  }
  SE3 T_world_cabin = road_.T_world_road(state.carrier_way);
  T_world_cabin.t.y() -= state.carrier_level;
  place(parts_.front(), T_world_cabin);
  for (std::size_t leaf = 1; leaf < parts_.size(); ++leaf) {
    const double open = (1 - state.doors) * kHalfWidth * (leaf == 1 ? -1 : 1);
    place(parts_[leaf], T_world_cabin * SE3{Matrix3::Identity(), {open, 0, 0}});
  }
  return out;
}

std::vector<MovingSurface> Carrier::at(double seconds) const {
  constexpr double kSoon = 1e-3;
  const std::vector<Surface> now = placed(seconds, 0), soon = placed(seconds, kSoon);
  std::vector<MovingSurface> out;
  for (std::size_t k = 0; k < now.size(); ++k)
    out.push_back({now[k], (soon[k].corners[0] - now[k].corners[0]) / kSoon});
  return out;
}

}  // namespace relmap::sim
