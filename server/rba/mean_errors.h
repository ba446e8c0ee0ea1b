// The mean reprojection error of each frame, by which the ripple of a relaxation spreads (docs/method.md, 4).
#pragma once

#include <cstdint>
#include <vector>

#include "server/rba/problem.h"

namespace relmap::rba {

struct MeanError {
  double sum = 0;  // in sigmas; one sigma is 1 px for a track at the pyramid's lowest level
  std::uint32_t terms = 0;
  double mean() const { return terms > 0 ? sum / terms : 0; }
};

// Larger errors, and those of points behind the camera, count as this, in sigmas. A mismatch is as wrong at 10 sigmas
// as at 300; uncapped, a few of them would dominate the mean of their frame, and with it the ripple.
inline constexpr double kMaxError = 10;

// Computes the mean errors over all observations of the problem, counted or not, by ProblemObservation::frame in
// 0 .. frames - 1. `poses` come from problem.compose().
void mean_errors(const Problem& problem, const std::vector<SE3>& poses, std::size_t frames,
                 std::vector<MeanError>* errors);

}  // namespace relmap::rba
