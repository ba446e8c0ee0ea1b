// Are probabilities what they say? Of claims that are made with about the same one, the share that came true.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "tools/vocab/evaluation.h"

namespace relmap::vocab {

struct Reliability {
  struct Bin {
    std::size_t claims = 0;
    double said = 0, came_true = 0;  // means
  };
  std::array<Bin, 10> bins;  // by the probability, from 0 to 1
  double error = 0;          // mean of |said - came_true| over the claims: the expected calibration error
  std::size_t claims = 0;
};

// Of claims of at least `least`: below it there are many, and nobody acts on them.
Reliability reliability(std::span<const Claim> claims, double least = 0.05);

struct ReliabilityCurve {
  std::string name;
  Reliability reliability;
};
// A diagram, as scalable vector graphics.
std::string draw(const std::vector<ReliabilityCurve>& curves);

}  // namespace relmap::vocab
