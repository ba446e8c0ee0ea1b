// Streams of random numbers that are keyed by a seed and up to three numbers (purpose, frame, item). Numbers are a pure
// function of the key, so that anything can be generated again, in any order, without what came before it.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace relmap::sim {

class Stream {
 public:
  explicit Stream(std::uint64_t seed, std::uint64_t a = 0, std::uint64_t b = 0, std::uint64_t c = 0)
      : state_(mix(mix(mix(mix(seed) + a) + b) + c)) {}

  std::uint64_t bits() {  // splitmix64
    state_ += 0x9e3779b97f4a7c15ULL;
    return mix(state_);
  }
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }  // [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {  // Box and Muller; the second of the pair is not kept, so that streams stay stateless
    const double u = 1 - uniform();
    const double v = uniform();
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
  }

 private:
  static std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  }
  std::uint64_t state_;
};

// A stream that is read in order, for painting and building picture worlds. Copies continue independently.
class Random : public Stream {
 public:
  using Stream::Stream;

  int below(int n) { return static_cast<int>(uniform() * n); }  // 0..n-1
  bool chance(double probability) { return uniform() < probability; }
  double sign() { return chance(0.5) ? 1 : -1; }
};

}  // namespace relmap::sim
