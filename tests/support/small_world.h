// Simulated drives of few and small keyframes, for tests that are about something else than what is in them.
#pragma once

#include <cstdint>
#include <string>

#include "tools/sim/points_world.h"

namespace relmap::testing {

// A lap takes longer than what place recognition leaves out, so that closures are found after one. `number` tells
// sessions of one world apart, whose noise differs.
inline sim::PointsWorldOptions small_world(std::uint32_t frames, std::uint32_t frames_per_lap, std::uint32_t appearance,
                                           std::uint8_t number = 1) {
  sim::PointsWorldOptions options;
  options.frames = frames;
  options.frames_per_lap = frames_per_lap;
  options.speed = 0.4;
  options.births = 16;
  options.appearance = appearance;
  options.noise_seed = number;
  options.uuid.bytes[15] = number;
  options.session = "drive-" + std::to_string(number);
  return options;
}

}  // namespace relmap::testing
