#include "tools/sim/picture_world_options.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "proto/base/number_text.h"
#include "tools/sim/itinerary.h"

namespace relmap::sim {
namespace {

const struct {
  RideKind kind;
  const char* name;
  double way;  // metres
} kRides[] = {
    {RideKind::kNone, "none", 0},           {RideKind::kLift, "lift", 42},   {RideKind::kLiftAlike, "lift-alike", 42},
    {RideKind::kLiftRamp, "lift-ramp", 52}, {RideKind::kTrain, "train", 60}, {RideKind::kEscalator, "escalator", 58},
    {RideKind::kAlike, "alike", 52}};

}  // namespace

const char* ride_name(RideKind kind) { return kRides[static_cast<int>(kind)].name; }

std::optional<RideKind> ride_of(const std::string& name) {
  for (const auto& ride : kRides)
    if (name == ride.name) return ride.kind;
  return std::nullopt;
}

Status PictureWorldOptions::set_faults(const std::string& text) {
  Result<std::vector<FaultEpisode>> read = parse_faults(text, frames, rate);
  if (!read.ok()) return read.status();
  faults = std::move(read).value();
  if (text == "all") drop_share = 0.05;
  return {};
}

Status PictureWorldOptions::check() const {
  const auto bad = [](const std::string& message) { return Status(Reason::INVALID_ARGUMENT, message); };
  if (frames < 1) return bad("frames must be at least 1");
  if (!(laps > 0) || !(step > 0) || !(rate > 0)) return bad("laps, step and rate must be positive");
  if (!std::isfinite(start)) return bad("the start must be so many metres along the circuit");
  if ((ride == RideKind::kNone) == (scene == SceneKind::kBuilding) && ride != RideKind::kTrain)
    return bad("rides but the train's are in the building, and it is there for them");
  if (ride == RideKind::kTrain && scene != SceneKind::kStreet) return bad("the train runs in the street");
  if (ride != RideKind::kNone && (start != 0 || ride_way < 40))
    return bad("a ride's way begins at 0 and is at least 40 m");
  if (ride == RideKind::kLiftRamp && !carried) return bad("from the end of the ramp only the lift leads on");
  const double length = circuit_length();
  const int min_length = scene == SceneKind::kMotorway ? 500 : 20,
            max_length = scene == SceneKind::kMotorway ? 5000 : 400;
  if (!(length >= min_length && length <= max_length))
    return bad("a circuit of " + number_text(length) + " m (frames * step / laps); it must be " +
               std::to_string(min_length) + " .. " + std::to_string(max_length) + " m long");
  if (!(lateral_deviation >= 0 && lateral_deviation <= 0.5)) return bad("the lateral deviation must be 0 .. 0.5 m");
  if (!(heading_deviation >= 0 && heading_deviation <= 0.3)) return bad("the heading deviation must be 0 .. 0.3 rad");
  if (!(camera_height >= 0.3 && camera_height <= 2.5)) return bad("the camera must be 0.3 .. 2.5 m above the ground");
  if (!(noise >= 0 && noise <= 50)) return bad("the noise must be 0 .. 50");
  if (!(exposure_variation >= 0 && exposure_variation <= 0.5)) return bad("the exposure must vary by 0 .. 0.5");
  if (!(exposure_jumps >= 0 && exposure_jumps <= 100)) return bad("the exposure must jump in 0 .. 100 of 100 frames");
  if (!(exposure_s >= 0 && exposure_s <= 0.1)) return bad("a picture must be exposed for 0 .. 0.1 s");
  if (!(drop_share >= 0 && drop_share <= 0.9)) return bad("the share of dropped pairs must be 0 .. 0.9");
  if (Status status = check_faults(faults, frames, rate); !status.ok()) return status;
  if (!camera.is_stereo()) return {Reason::NOT_STEREO, "the simulated camera needs a baseline"};
  return camera.check_plausible();
}

StereoCamera scaled(StereoCamera camera, int width) {
  const double factor = static_cast<double>(width) / camera.width;
  camera.width = width;
  camera.height = static_cast<int>(std::lround(camera.height * factor));
  camera.f *= factor;
  camera.cx = (camera.cx + 0.5) * factor - 0.5;
  camera.cy = (camera.cy + 0.5) * factor - 0.5;
  return camera;
}

PictureWorldOptions motorway_options(std::uint64_t seed, int frames) {
  PictureWorldOptions o;
  o.scene = SceneKind::kMotorway;
  o.seed = seed;
  o.frames = frames;
  o.step = 2.5;
  o.laps = frames * o.step / std::clamp(frames * o.step, 2000.0, 5000.0);
  o.camera = {.f = 718, .cx = 609, .cy = 172, .baseline = 0.54, .width = 1242, .height = 375};
  o.camera_height = 1.65;
  o.heading_deviation = 0.01;
  return o;
}

PictureWorldOptions ride_options(RideKind kind, std::uint64_t seed, bool carried) {
  PictureWorldOptions o;
  o.seed = seed;
  o.ride = kind;
  o.carried = carried;
  o.ride_way = kRides[static_cast<int>(kind)].way;
  if (kind != RideKind::kTrain) {
    o.scene = SceneKind::kBuilding;
    o.lateral_deviation = 0.15;  // a corridor is narrow
  }
  o.frames = frames_of_ride(o);
  return o;
}

int frames_of_ride(const PictureWorldOptions& o) { return static_cast<int>(sim::Itinerary(o).seconds() * o.rate) + 1; }

}  // namespace relmap::sim
