// The keyframes of a fleet: every robot drives the same circuit again and again, from a start of its own. One lap is
// made once; what a robot sends is a frame of it under the robot's own name, time, odometry and noise. Tracks go on
// from keyframe to keyframe and places are seen again by all, so that the map has its usual work with them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/keyframe/keyframe.h"

namespace relmap::bench {

// Everything that a robot's keyframes depend on, except their odometry.
struct FleetRobot {
  std::uint32_t number = 0;
  std::uint64_t seed = 1;   // of the fleet
  std::uint32_t start = 0;  // frame of the lap that is its keyframe 0
  std::int64_t start_us = 0, period_us = 200'000;

  SessionUuid uuid() const;
  std::string name() const { return "robot " + std::to_string(number); }
  std::int64_t time_us(std::uint32_t sequence) const { return start_us + sequence * period_us; }
};

inline constexpr std::uint32_t kLapFrames = 400;

// Where the robot of a fleet of `robots` starts: they are spread over the lap.
inline std::uint32_t start_of(std::uint32_t number, std::uint32_t robots) { return number * kLapFrames / robots; }

class FleetLap {
 public:
  // The file of a lap whose keyframes have `keyframe_bytes` each, about a seventh of it a picture. Throws.
  static void make(const std::string& file, std::size_t keyframe_bytes, std::uint64_t seed);

  explicit FleetLap(const std::string& file);  // throws

  static SessionHeader header(const FleetRobot& robot);
  // `T_odom_previous`: that of the keyframe before; any at sequence 0.
  Keyframe keyframe(const FleetRobot& robot, std::uint32_t sequence, const SE3& T_odom_previous) const;

 private:
  void continue_tracks(const FleetRobot& robot, std::uint32_t sequence, Keyframe& keyframe) const;
  static void add_noise(const FleetRobot& robot, Keyframe& keyframe);

  std::vector<Keyframe> frames_;  // their sequences, those of tracks among them, count on from lap to lap
  std::vector<SE3> steps_;        // to each from the one before it, as they truly were
};

}  // namespace relmap::bench
