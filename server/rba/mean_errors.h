// The mean reprojection error of each frame, by which the ripple of a relaxation spreads (docs/method.md, 4).
#pragma once

#include <cstdint>
#include <vector>

#include "server/rba/problem.h"

namespace relmap::rba {

struct MeanError {
  double sum = 0;  // in sigmas: px of a track at the pyramid's lowest level
  std::uint32_t terms = 0;
  double mean() const { return terms > 0 ? sum / terms : 0; }
};

// A mismatch is as wrong at 300 px as at this, and a point behind the camera no worse: else a few of them would make
// the mean of their frame, and with it the ripple.
inline constexpr double kMaxError = 10;

// Over all observations of the problem, counted or not, by ProblemObservation::frame, 0 .. frames - 1. `poses` are
// problem.compose()'s.
void mean_errors(const Problem& problem, const std::vector<SE3>& poses, std::size_t frames,
                 std::vector<MeanError>* errors);

}  // namespace relmap::rba
