// A smooth random function, for the deviation of a drive from its road.
#pragma once

#include <array>
#include <cmath>

#include "tools/sim/random.h"

namespace relmap::sim {

// Within +-1; its waves do not repeat with the laps.
class Wander {
 public:
  // Wavelengths are between `min_wave` and `max_wave`, in units of at()'s argument.
  Wander(Random random, double min_wave, double max_wave) {
    for (Wave& wave : waves_) {
      wave.rate = 2 * M_PI / random.uniform(min_wave, max_wave);
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

}  // namespace relmap::sim
