// Smooth random textures that can be sampled at any position, for the tests of the front-end.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "frontend/vision/image.h"

namespace relmap::vision::testing_textures {

// A sum of plane waves of random direction, wavelength and phase: its value between pixels is known exactly.
class Waves {
 public:
  explicit Waves(unsigned seed, double min_wavelength = 6, double max_wavelength = 40, int count = 24) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < count; ++i) {
      const double wavelength = min_wavelength * std::pow(max_wavelength / min_wavelength, unit(random));
      const double direction = 2 * M_PI * unit(random);
      waves_.push_back({2 * M_PI / wavelength * std::cos(direction), 2 * M_PI / wavelength * std::sin(direction),
                        2 * M_PI * unit(random)});
    }
  }
  double at(double x, double y) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += std::sin(w.kx * x + w.ky * y + w.phase);
    return 128 + 90 * sum / std::sqrt(2.0 * static_cast<double>(waves_.size()));
  }

 private:
  struct Wave {
    double kx, ky, phase;
  };
  std::vector<Wave> waves_;
};

// Fills a picture with value(x, y), rounded and clamped to 0..255.
template <typename Value>
Image paint(int width, int height, const Value& value) {
  Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.row(y)[x] = static_cast<std::uint8_t>(std::min(255.0, std::max(0.0, std::round(value(x, y)))));
  return image;
}

// Two pictures of the same waves, each with noise of one grey level. The second is brighter, has less contrast and is
// shifted by (dx, dy).
inline std::pair<Image, Image> seen_twice(const Waves& waves, std::mt19937& random, int width, int height, double dx,
                                          double dy) {
  std::normal_distribution<double> noise(0, 1);
  Image first = paint(width, height, [&](int x, int y) { return waves.at(x, y) + noise(random); });
  Image second =
      paint(width, height, [&](int x, int y) { return 20 + 0.9 * waves.at(x - dx, y - dy) + noise(random); });
  return {std::move(first), std::move(second)};
}

}  // namespace relmap::vision::testing_textures
