#include "tools/sim/traffic.h"

#include <cmath>

#include "tools/sim/motorway_scene.h"

namespace relmap::sim {
namespace {

constexpr double kTexels = 60;  // per metre
constexpr double kSight = 220;  // metres
constexpr double kLength = 4.4, kWidth = 1.8, kBonnet = 0.9, kRoof = 1.45, kClearance = 0.2;

Canvas paint_side(double colour) {
  Canvas canvas(kLength, kBonnet - kClearance, kTexels, colour);
  canvas.fill_rect(0, 0.5, kLength, kBonnet, 0.6 * colour);
  for (const double x : {0.8, kLength - 0.8}) {
    canvas.fill_ellipse(x, 0.55, 0.32, 0.32, 25);
    canvas.fill_ellipse(x, 0.55, 0.18, 0.18, 120);
  }
  return canvas;
}

Canvas paint_end(double colour) {
  Canvas canvas(kWidth, kBonnet - kClearance, kTexels, colour);
  canvas.fill_rect(0, 0.45, kWidth, kBonnet, 0.5 * colour);
  for (const double x : {0.05, kWidth - 0.35}) canvas.fill_rect(x, 0.08, x + 0.3, 0.24, 70);
  canvas.fill_rect(kWidth / 2 - 0.26, 0.26, kWidth / 2 + 0.26, 0.37, 210);
  return canvas;
}

Canvas paint_glass(double width, double colour) {
  Canvas canvas(width, kRoof - kBonnet, kTexels, colour);
  canvas.fill_rect(0.12, 0.08, width - 0.12, kRoof, 45);
  return canvas;
}

}  // namespace

Traffic::Model Traffic::paint_model(Scene& scene, Random& random) {
  const double colour = random.uniform(40, 215);
  Model model;
  const auto add = [&](const Canvas& canvas) {
    scene.textures.emplace_back(canvas);
    return static_cast<int>(scene.textures.size()) - 1;
  };
  const auto face = [&](const Vector3& corner, const Vector3& across, const Vector3& down, int texture) {
    const std::array<Vector3, 4> corners{corner, corner + across, corner + across + down, corner + down};
    const double w = across.norm() * kTexels, h = down.norm() * kTexels;
    model.push_back(make_surface(corners, {Vector2(0, 0), Vector2(w, 0), Vector2(w, h)}, texture));
  };
  const auto box = [&](double half_width, double back, double front, double top, double foot, int side, int end,
                       int lid) {
    const Vector3 down(0, top - foot, 0), across(2 * half_width, 0, 0), along(0, 0, front - back);
    const Vector3 corner(-half_width, -top, back);
    face(corner, along, down, side);
    face(corner + across, along, down, side);
    face(corner, across, down, end);
    face(corner + along, across, down, end);
    face(corner, across, along, lid);
  };
  const int lid = add(Canvas(0.5, 0.5, kTexels, colour));
  box(kWidth / 2, -kLength / 2, kLength / 2, kBonnet, kClearance, add(paint_side(colour)), add(paint_end(colour)), lid);
  box(kWidth / 2 - 0.12, -kLength / 2 + 0.4, 0.8, kRoof, kBonnet, add(paint_glass(kLength / 2 + 0.4, colour)),
      add(paint_glass(kWidth - 0.24, colour)), lid);
  return model;
}

Traffic::Traffic(const Circuit& circuit, double speed, Scene& scene, Random random) : circuit_(circuit) {
  for (Model& model : models_) model = paint_model(scene, random);
  const auto model = [&] { return random.below(static_cast<int>(models_.size())); };
  cars_.push_back({model(), 0, random.uniform(28, 60), speed});
  cars_.push_back({model(), 0, -random.uniform(25, 60), speed});
  const double opposite = 2 * kMedian;
  const struct {
    double lane, speed, spacing;
  } lanes[] = {{kLaneWidth, speed - 4, 80},
               {-kLaneWidth, speed + 5, 130},
               {opposite - kLaneWidth, -speed, 90},
               {opposite, -speed - 3, 110},
               {opposite + kLaneWidth, -speed - 8, 160}};
  for (const auto& lane : lanes)  // within a lane all are as fast: none runs into another
    for (double s = random.uniform(0, lane.spacing); s < circuit.length() - 20;
         s += lane.spacing * random.uniform(0.4, 1.6))
      cars_.push_back({model(), lane.lane, s, lane.speed});
}

std::vector<MovingSurface> Traffic::near(const Vector2& place, double seconds) const {
  std::vector<MovingSurface> out;
  for (const Car& car : cars_) {
    const double s = car.start + car.speed * seconds;
    const Vector2 at = circuit_.beside(s, car.lane);
    if ((at - place).norm() > kSight) continue;
    const Vector2 ahead = circuit_.direction(s) * (car.speed < 0 ? -1 : 1);
    SE3 T_world_car;
    T_world_car.R.col(0) = Vector3(ahead.y(), 0, -ahead.x());
    T_world_car.R.col(1) = Vector3(0, 1, 0);
    T_world_car.R.col(2) = Vector3(ahead.x(), 0, ahead.y());
    T_world_car.t = Vector3(at.x(), 0, at.y());
    const Vector3 velocity = std::abs(car.speed) * T_world_car.R.col(2);
    for (const Surface& surface : models_[car.model]) out.push_back({moved(surface, T_world_car), velocity});
  }
  return out;
}

}  // namespace relmap::sim
