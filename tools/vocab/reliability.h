// Reliability of probabilities: of predictions with about the same probability, the share that came true.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "tools/vocab/evaluation.h"

namespace relmap::vocab {

struct Reliability {
  struct Bin {
    std::size_t predictions = 0;
    double said = 0, came_true = 0;  // means
  };
  std::array<Bin, 10> bins;  // by the probability, from 0 to 1
  double error = 0;          // mean of |said - came_true| over the predictions: the expected calibration error
  std::size_t predictions = 0;
};

// Evaluates predictions of at least `min_probability`: there are many below, and nobody acts on them.
Reliability reliability(std::span<const Prediction> predictions, double min_probability = 0.05);

struct ReliabilityCurve {
  std::string name;
  Reliability reliability;
};
// Draws a reliability diagram as SVG.
std::string draw(const std::vector<ReliabilityCurve>& curves);

}  // namespace relmap::vocab
