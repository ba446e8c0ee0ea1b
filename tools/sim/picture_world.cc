#include "tools/sim/picture_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "tools/sim/board.h"
#include "tools/sim/building_scene.h"
#include "tools/sim/carrier.h"
#include "tools/sim/circuit.h"
#include "tools/sim/exposure.h"
#include "tools/sim/motion_blur.h"
#include "tools/sim/motorway_scene.h"
#include "tools/sim/random.h"
#include "tools/sim/renderer.h"
#include "tools/sim/street_scene.h"
#include "tools/sim/traffic.h"

namespace relmap::sim {
namespace {

using sim::Random;

constexpr double kLongExposure = 0.04;  // seconds, where the camera's exposure is at fault

// The camera's noise: a table of normally distributed values, read in random order.
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

struct PictureWorld::State {
  explicit State(const PictureWorldOptions& o)
      : options(o),
        circuit(is_motorway() ? sim::motorway_circuit(o.seed, o.circuit_length())
                              : sim::Circuit(o.seed, o.circuit_length())),
        faults(o.faults, o.drop_share, o.rate, o.seed_of_drive()),
        trajectory(options, circuit, faults),
        scene(build_scene()),
        exposure(o) {
    if (o.ride != RideKind::kNone && o.ride != RideKind::kAlike)
      carrier.emplace(options, *trajectory.itinerary(), trajectory.road(), scene, Random(o.seed, 40));
    light_scene(scene, o.light);
    if (is_motorway()) traffic.emplace(circuit, o.step * o.rate, scene, Random(o.seed_of_drive(), 31));
    for (const FaultEpisode& e : o.faults)
      if (e.kind == FaultKind::kMover && !board) board.emplace(o.camera, scene, Random(o.seed_of_drive(), 20));
  }

  sim::Scene build_scene() const {
    switch (options.scene) {
      case SceneKind::kStreet:
        return sim::build_street(circuit, options.seed);
      case SceneKind::kMotorway:
        return sim::build_motorway(circuit, options.seed);
      case SceneKind::kBuilding:
        return sim::build_building(options, trajectory.road());
    }
    return {};
  }

  GreyPicture expose(const std::vector<float>& light, double gain, std::uint64_t stream) const {
    GreyPicture out{options.camera.width, options.camera.height, std::vector<std::uint8_t>(light.size())};
    static const SensorNoise sensor_noise;
    auto bits = static_cast<std::uint32_t>(Random(options.seed_of_drive(), stream).bits()) | 1U;
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

  sim::Snapshot snapshot(int i, const sim::Motion& motion) const {
    sim::Snapshot out{scene, {}};
    const Vector3& place = motion.T_world_left.t;
    if (carrier) out.moving = carrier->at(i / options.rate);
    if (traffic) out.moving = traffic->near({place.x(), place.z()}, i / options.rate);
    if (const double t = faults.since(FaultKind::kMover, i); t >= 0) out.moving.push_back(board->at(t, motion));
    return out;
  }

  std::vector<float> light(int i, bool right) const {
    const StereoCamera& camera = options.camera;
    if (faults.black(i, right)) return std::vector<float>(static_cast<std::size_t>(camera.width) * camera.height);
    const sim::Motion motion = trajectory.motion(i);
    const sim::Snapshot seen = snapshot(i, motion);
    const Vector3 eye(right ? camera.baseline : 0, 0, 0);
    const SE3 T_world_eye = motion.T_world_left * SE3{Matrix3::Identity(), eye};
    const double exposure_s = faults.since(FaultKind::kBlur, i) >= 0 ? kLongExposure : options.exposure_s;
    if (exposure_s == 0)
      return sim::shade(seen, camera, T_world_eye, sim::find_visible(seen, camera, T_world_eye, sim::kSamplesPerSide));
    const Vector3 velocity = motion.T_world_left.R.transpose() * motion.velocity + motion.angular_velocity.cross(eye);
    return sim::shade_blurred(seen, camera, {T_world_eye, velocity, motion.angular_velocity}, exposure_s);
  }

  std::int64_t true_time_us(int i) const { return options.start_us + std::llround(i * 1e6 / options.rate); }

  bool is_motorway() const { return options.scene == SceneKind::kMotorway; }

  PictureWorldOptions options;
  sim::Circuit circuit;
  sim::FaultSchedule faults;
  sim::Trajectory trajectory;
  sim::Scene scene;
  sim::Exposure exposure;
  std::optional<sim::Traffic> traffic;  // on a motorway
  std::optional<sim::Board> board;      // if it ever appears
  std::optional<sim::Carrier> carrier;  // of a ride
};

PictureWorld::PictureWorld(const PictureWorldOptions& options) : state_(std::make_unique<State>(options)) {}
PictureWorld::~PictureWorld() = default;
PictureWorld::PictureWorld(PictureWorld&&) noexcept = default;
PictureWorld& PictureWorld::operator=(PictureWorld&&) noexcept = default;

const PictureWorldOptions& PictureWorld::options() const { return state_->options; }

SE3 PictureWorld::truth(int i) const { return state_->trajectory.pose(i); }

SE3 PictureWorld::truth_at(double seconds) const { return state_->trajectory.pose(seconds * options().rate); }

sim::Motion PictureWorld::motion_at(double seconds) const {
  return state_->trajectory.motion(seconds * options().rate);
}

std::int64_t PictureWorld::time_us(int i) const {
  switch (fault_at(i)) {
    case FaultKind::kTimeBack:
      return state_->true_time_us(i - 1) - 500'000;
    case FaultKind::kTimeAhead:
      return state_->true_time_us(i) + 3'600'000'000;
    default:
      return state_->true_time_us(i);
  }
}

const std::vector<FaultEpisode>& PictureWorld::faults() const { return state_->faults.episodes(); }

FaultKind PictureWorld::fault_at(int i) const { return state_->faults.at(i); }

bool PictureWorld::dropped(int i) const { return state_->faults.dropped(i); }

StereoPictures PictureWorld::render(int i) const {
  const State& w = *state_;
  const int shown = w.faults.shown(i);
  const double gain = sim::brightness(w.options.light) * w.exposure.gain(shown, w.trajectory.distance(shown));
  const auto stream = 1000 + 2 * static_cast<std::uint64_t>(shown);
  return {w.expose(w.light(shown, false), gain, stream), w.expose(w.light(shown, true), gain * 1.01, stream + 1)};
}

bool PictureWorld::riding(int i) const {
  const sim::Itinerary* itinerary = state_->trajectory.itinerary();
  return itinerary && itinerary->at(i / options().rate).riding;
}

bool PictureWorld::carried(int i) const {
  const sim::Itinerary* itinerary = state_->trajectory.itinerary();
  return itinerary && itinerary->at(i / options().rate).carried;
}

std::vector<bool> PictureWorld::moving(int i) const {
  const State& w = *state_;
  const sim::Motion motion = w.trajectory.motion(i);
  const sim::Snapshot seen = w.snapshot(i, motion);
  std::vector<bool> out;
  for (const std::int32_t surface : sim::find_visible(seen, w.options.camera, motion.T_world_left, 1).surface)
    out.push_back(surface >= 0 && seen.is_moving(static_cast<std::size_t>(surface)));
  return out;
}

std::vector<float> PictureWorld::render_depth(int i) const {
  const State& w = *state_;
  const sim::Motion motion = w.trajectory.motion(i);
  std::vector<float> depth =
      sim::find_visible(w.snapshot(i, motion), w.options.camera, motion.T_world_left, 1).inverse_depth;
  for (float& value : depth) value = value > 0 ? 1 / value : 0;
  return depth;
}

}  // namespace relmap::sim
