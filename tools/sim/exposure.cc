#include "tools/sim/exposure.h"

#include <algorithm>
#include <cmath>

namespace relmap::sim {
namespace {

constexpr int kRecovery = 10;  // frames until a jump is undone

}  // namespace

Exposure::Exposure(const PictureWorldOptions& o)
    : seed_(o.seed_of_drive()),
      variation_(o.exposure_variation),
      jump_share_(o.exposure_jumps / 100),
      wander_(Random(o.seed_of_drive(), 17), 20 * o.stretch(), 70 * o.stretch()) {}

double Exposure::jump(int i) const {
  Random random(seed_, 18, static_cast<std::uint64_t>(i));
  return random.chance(jump_share_) ? random.uniform(0.6, 1.6) : 1;
}

double Exposure::gain(int i, double distance) const {
  double gain = 1 + variation_ * wander_.at(distance);
  if (jump_share_ > 0)
    for (int age = 0; age < std::min(kRecovery, i + 1); ++age)
      gain *= std::pow(jump(i - age), 1 - static_cast<double>(age) / kRecovery);
  return gain;
}

}  // namespace relmap::sim
