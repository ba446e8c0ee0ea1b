#include "tools/sim/daylight.h"

#include <cmath>

#include "tools/sim/random.h"

namespace relmap::sim {
namespace {

struct Lamp {
  Daylight light;
  const char* name;
  Vector3 towards_sun;  // y is down
  double diffuse, direct;
  double warmth;  // by how much the colour of a surface may change its brightness, and which way
  double brightness;
};

const Lamp kLamps[] = {
    {Daylight::kClear, "clear", {0.5, -0.6, 0.62}, sim::kDiffuseLight, sim::kDirectLight, 0, 1},
    {Daylight::kMorning, "morning", {0.9, -0.25, -0.35}, 0.6, 0.7, 0.15, 0.9},
    {Daylight::kEvening, "evening", {-0.3, -0.2, 0.95}, 0.55, 0.75, 0.25, 0.8},
    {Daylight::kOvercast, "overcast", {0, -1, 0}, 0.95, 0.1, -0.15, 0.75},
    {Daylight::kDusk, "dusk", {-0.8, -0.1, -0.6}, 0.9, 0.2, -0.25, 0.35},
};

const Lamp& lamp_of(Daylight light) { return kLamps[static_cast<int>(light)]; }

}  // namespace

const char* daylight_name(Daylight light) { return lamp_of(light).name; }

std::optional<Daylight> daylight_of(const std::string& name) {
  for (const Lamp& lamp : kLamps)
    if (name == lamp.name) return lamp.light;
  return std::nullopt;
}

void light_scene(Scene& scene, Daylight light) {
  if (light == Daylight::kClear) return;
  const Lamp &clear = lamp_of(Daylight::kClear), &lamp = lamp_of(light);
  for (Surface& surface : scene.surfaces) {
    const auto falling = [&](const Lamp& l) {
      return l.diffuse + l.direct * std::abs(surface.normal.dot(l.towards_sun.normalized()));
    };
    const double colour = Stream(41, static_cast<std::uint64_t>(surface.texture)).uniform(-1, 1);
    surface.gain *= static_cast<float>(falling(lamp) / falling(clear) * (1 + lamp.warmth * colour));
  }
}

double brightness(Daylight light) { return lamp_of(light).brightness; }

}  // namespace relmap::sim
