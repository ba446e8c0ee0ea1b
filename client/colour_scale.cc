#include "client/colour_scale.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relmap::client {

namespace {

using Polynomial = std::array<std::array<double, 3>, 7>;  // of red, green and blue, the constants first

constexpr Polynomial kViridis{{{0.2777273272, 0.0054073445, 0.3340998053},
                               {0.1050930431, 1.4046135299, 1.3845901626},
                               {-0.3308618287, 0.2148475595, 0.0950951630},
                               {-4.6342304990, -5.7991009734, -19.3324409563},
                               {6.2282699363, 14.1799333668, 56.6905526007},
                               {4.7763849977, -13.7451453777, -65.3530326334},
                               {-5.4354558559, 4.6458526122, 26.3124352496}}};
constexpr Polynomial kPlasma{{{0.0587323439, 0.0233367089, 0.5433401827},
                              {2.1765146342, 0.2383834171, 0.7539604600},
                              {-2.6894604765, -7.4558511357, 3.1107999397},
                              {6.1303483459, 42.3461881477, -28.5188546533},
                              {-11.1074361906, -82.6663110943, 60.1398476742},
                              {10.0230655766, 71.4136177010, -54.0721865556},
                              {-3.6587138428, -22.9315346546, 18.1919077854}}};

Colour value_of(const Polynomial& scale, double t) {
  t = std::isfinite(t) ? std::clamp(t, 0.0, 1.0) : 0.0;
  std::array<std::uint8_t, 3> channels{};
  for (std::size_t c = 0; c < 3; ++c) {
    double value = 0;
    for (auto power = scale.rbegin(); power != scale.rend(); ++power) value = value * t + (*power)[c];
    channels[c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
  }
  return {channels[0], channels[1], channels[2]};
}

}  // namespace

Colour viridis(double t) { return value_of(kViridis, t); }
Colour plasma(double t) { return value_of(kPlasma, t); }

Colour paper_scale(double t) {
  constexpr double kPalest = 0.86;  // lighter ones are hard to see on white
  return viridis(kPalest * (1 - std::clamp(t, 0.0, 1.0)));
}

Colour picture_scale(double t) {
  constexpr double kDarkest = 0.3;  // darker ones are lost in shadows
  return plasma(kDarkest + (1 - kDarkest) * std::clamp(t, 0.0, 1.0));
}

}  // namespace relmap::client
