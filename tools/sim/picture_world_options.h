// The options of a picture world.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "proto/geometry/camera.h"
#include "tools/sim/daylight.h"
#include "tools/sim/faults.h"

namespace relmap::sim {

enum class SceneKind {
  kStreet,    // houses close by, texture everywhere
  kMotorway,  // plain surfaces, little that is near, other cars
  kBuilding,  // corridors, on one floor or two
};

// How the robot is carried without moving itself (itinerary.h).
enum class RideKind {
  kNone,
  kLift,       // up and down again between two floors that look different
  kLiftAlike,  // the same, between floors that look alike except for a few things
  kLiftRamp,   // up a ramp that winds once round, and down to the start by lift
  kTrain,      // along a part of the street, in a wagon that fills about half of the view
  kEscalator,  // up an escalator that fills nearly all of the view, and down a ramp
  kAlike,      // not carried: it stands still as long, in a building whose halves look alike except for a few things
};
// As on the command line: "none", "lift", "lift-alike", "lift-ramp", "train", "escalator", "alike".
const char* ride_name(RideKind kind);
std::optional<RideKind> ride_of(const std::string& name);

struct PictureWorldOptions {
  SceneKind scene = SceneKind::kStreet;
  std::uint64_t seed = 1;                   // of the world and its circuit
  std::optional<std::uint64_t> drive_seed;  // of sway, speed, traffic, exposure, noise and faults; nullopt: `seed`
  Daylight light = Daylight::kClear;
  int frames = 650;
  double laps = 1.3;  // number of laps: the circuit is frames * step / laps long
  double start = 0;   // place of the first frame, metres along the circuit
  double step = 0.2;  // metres between two frames, on average
  RideKind ride = RideKind::kNone;
  bool carried = true;                            // false: the robot waits where it would board, and drives all the way
  double ride_way = 0;                            // length of the circuit of a ride, metres
  double rate = 10;                               // frames per second
  std::int64_t start_us = 1'600'000'000'000'000;  // UTC time of the first frame
  StereoCamera camera{.f = 400, .cx = 255.5, .cy = 191.5, .baseline = 0.12, .width = 512, .height = 384};
  double camera_height = 1.0;        // metres above the ground
  double lateral_deviation = 0.25;   // metres, at most, beside the middle of the road
  double heading_deviation = 0.04;   // radians, at most
  double noise = 2.0;                // standard deviation of a pixel's value (0..255)
  double exposure_variation = 0.06;  // relative, at most, slowly over the drive
  double exposure_jumps =
      0;                  // sudden changes of the gain per 100 frames, by a factor of 0.6 .. 1.6, back within 10 frames
  double exposure_s = 0;  // exposure time in seconds, centred on the time of the picture: motion blur

  double drop_share = 0;             // share of the pairs that are missing
  std::vector<FaultEpisode> faults;  // they must not overlap

  // Sets faults as parse_faults() reads them; "all" also sets drop_share to 0.05. Set `frames` and `rate` before.
  Status set_faults(const std::string& text);
  // Factor for the wavelengths of the sway: a fast car must not sway as often as a slow robot.
  double stretch() const { return scene == SceneKind::kMotorway ? 12 : 1; }
  std::uint64_t seed_of_drive() const { return drive_seed.value_or(seed); }
  double circuit_length() const { return ride == RideKind::kNone ? frames * step / laps : ride_way; }
  // INVALID_ARGUMENT, or IMPLAUSIBLE_CALIBRATION of the camera. The circuit must be 20 .. 400 m long, that of a
  // motorway 500 .. 5000 m.
  Status check() const;
};

// A camera with the same field of view and pictures of another width.
StereoCamera scaled(StereoCamera camera, int width);

// A car with KITTI's camera at 25 m/s and 10 Hz.
PictureWorldOptions motorway_options(std::uint64_t seed, int frames);

// A drive with a ride. It has as many frames as it takes to see a good part of its first section again.
PictureWorldOptions ride_options(RideKind kind, std::uint64_t seed, bool carried = true);
// The frames of the whole drive, at the options' step and rate.
int frames_of_ride(const PictureWorldOptions& options);

}  // namespace relmap::sim
