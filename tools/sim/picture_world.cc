#include "tools/sim/picture_world.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/sim/circuit.h"
#include "tools/sim/random.h"
#include "tools/sim/renderer.h"
#include "tools/sim/street_scene.h"

namespace relmap {
namespace {

using sim::Random;

// A smooth function within +-1 whose waves do not repeat with the laps.
class Wander {
 public:
  Wander(Random random, double shortest, double longest) {
    for (Wave& wave : waves_) {
      wave.rate = 2 * M_PI / random.uniform(shortest, longest);
      wave.phase = random.uniform(0, 2 * M_PI);
    }
  }
  double at(double s) const {
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::sin(wave.rate * s + wave.phase);
    return sum / static_cast<double>(waves_.size());
  }

 private:
  struct Wave {
    double rate, phase;
  };
  std::array<Wave, 3> waves_;
};

// The camera's noise: a table of normal values, read in a random order.
class SensorNoise {
 public:
  SensorNoise() {
    Random random(20260101);
    for (float& value : table_) value = static_cast<float>(random.normal());
  }
  float operator()(std::uint32_t bits) const { return table_[bits >> 20]; }

 private:
  std::array<float, 4096> table_;
};

}  // namespace

Status PictureWorldOptions::check() const {
  const auto bad = [](const std::string& message) { return Status(Reason::INVALID_ARGUMENT, message); };
  if (frames < 1) return bad("frames must be at least 1");
  if (!(laps > 0) || !(step > 0) || !(rate > 0)) return bad("laps, step and rate must be positive");
  const double length = circuit_length();
  if (!(length >= 20 && length <= 400))
    return bad("a circuit of " + std::to_string(length) + " m (frames * step / laps); it must be 20 .. 400 m long");
  if (!(lateral_deviation >= 0 && lateral_deviation <= 0.5)) return bad("the lateral deviation must be 0 .. 0.5 m");
  if (!(heading_deviation >= 0 && heading_deviation <= 0.3)) return bad("the heading deviation must be 0 .. 0.3 rad");
  if (!(camera_height >= 0.3 && camera_height <= 2.5)) return bad("the camera must be 0.3 .. 2.5 m above the ground");
  if (!(noise >= 0 && noise <= 50)) return bad("the noise must be 0 .. 50");
  if (!(exposure_variation >= 0 && exposure_variation <= 0.5)) return bad("the exposure must vary by 0 .. 0.5");
  if (!camera.is_stereo()) return {Reason::NOT_STEREO, "the simulated camera needs a baseline"};
  return camera.check_plausible();
}

struct PictureWorld::State {
  explicit State(const PictureWorldOptions& o)
      : options(o),
        circuit(o.seed, o.circuit_length()),
        scene(sim::build_street(circuit, o.seed)),
        lateral(Random(o.seed, 11), 13, 47),
        heading(Random(o.seed, 12), 9, 31),
        pitch(Random(o.seed, 13), 5, 17),
        roll(Random(o.seed, 14), 6, 23),
        bounce(Random(o.seed, 15), 4, 11),
        speed(Random(o.seed, 16), 15, 40),
        exposure(Random(o.seed, 17), 20, 70) {}

  GreyPicture expose(const std::vector<float>& light, double gain, std::uint64_t stream) const {
    GreyPicture out{options.camera.width, options.camera.height, std::vector<std::uint8_t>(light.size())};
    static const SensorNoise sensor_noise;
    auto bits = static_cast<std::uint32_t>(Random(options.seed, stream).bits()) | 1U;
    const auto scale = static_cast<float>(gain), sigma = static_cast<float>(options.noise);
    for (std::size_t k = 0; k < light.size(); ++k) {
      bits ^= bits << 13;
      bits ^= bits >> 17;
      bits ^= bits << 5;
      const float value = light[k] * scale + sigma * sensor_noise(bits) + 0.5F;
      out.pixels[k] = static_cast<std::uint8_t>(std::clamp(value, 0.0F, 255.0F));
    }
    return out;
  }

  double distance(int i) const { return options.step * i + speed.at(options.step * i); }

  PictureWorldOptions options;
  sim::Circuit circuit;
  sim::Scene scene;
  Wander lateral, heading, pitch, roll, bounce, speed, exposure;
};

PictureWorld::PictureWorld(const PictureWorldOptions& options) : state_(std::make_unique<State>(options)) {}
PictureWorld::~PictureWorld() = default;
PictureWorld::PictureWorld(PictureWorld&&) noexcept = default;
PictureWorld& PictureWorld::operator=(PictureWorld&&) noexcept = default;

const PictureWorldOptions& PictureWorld::options() const { return state_->options; }

SE3 PictureWorld::truth(int i) const {
  const State& w = *state_;
  const double s = w.distance(i), small = 0.01;
  const auto place = [&](double at) { return w.circuit.beside(at, w.options.lateral_deviation * w.lateral.at(at)); };
  const Vector2 here = place(s), forward = (place(s + small) - place(s - small)).normalized();
  SE3 level;  // columns: right, down, forward
  level.R.col(0) = Vector3(forward.y(), 0, -forward.x());
  level.R.col(1) = Vector3(0, 1, 0);
  level.R.col(2) = Vector3(forward.x(), 0, forward.y());
  level.t = Vector3(here.x(), -w.options.camera_height + 0.015 * w.bounce.at(s), here.y());
  const Vector3 turn(0.012 * w.pitch.at(s), w.options.heading_deviation * w.heading.at(s), 0.010 * w.roll.at(s));
  return SE3{level.R * so3_exp(turn), level.t};
}

std::int64_t PictureWorld::time_us(int i) const {
  return state_->options.start_us + std::llround(i * 1e6 / state_->options.rate);
}

StereoPictures PictureWorld::render(int i) const {
  const State& w = *state_;
  const SE3 T_world_left = truth(i);
  const SE3 T_world_right = T_world_left * SE3{Matrix3::Identity(), Vector3(w.options.camera.baseline, 0, 0)};
  const double gain = 1 + w.options.exposure_variation * w.exposure.at(w.distance(i));
  const auto stream = 1000 + 2 * static_cast<std::uint64_t>(i);
  return {w.expose(sim::shade(w.scene, w.options.camera, T_world_left), gain, stream),
          w.expose(sim::shade(w.scene, w.options.camera, T_world_right), gain * 1.01, stream + 1)};
}

std::vector<float> PictureWorld::render_depth(int i) const {
  std::vector<float> depth = sim::find_visible(state_->scene, state_->options.camera, truth(i), 1).inverse_depth;
  for (float& value : depth) value = value > 0 ? 1 / value : 0;
  return depth;
}

}  // namespace relmap
