// Levenberg-Marquardt on a relative bundle adjustment. A step is kept only if the true cost falls; otherwise it is
// undone and the damping raised. Plain Gauss-Newton diverges on landmarks of low disparity.
#pragma once

#include <cstdint>

#include "server/rba/problem.h"

namespace relmap::rba {

struct SolverOptions {
  int max_iterations = 6;           // linearisations
  double huber = 2;                 // sigmas
  double relative_decrease = 1e-2;  // of the cost; a step that gains less is the last: the next would gain its square
};

struct SolverReport {
  bool failed = false;  // NUMERICAL: singular, or not a number; the problem is as it was
  int iterations = 0;
  int accepted = 0;
  std::uint64_t work = 0;  // linearised observations
  double cost_before = 0, cost_after = 0;
};

// Solves in place. With `covariance`, those of the columns that are wanted[column] at the solution, from the inverse of
// the reduced system.
struct CovarianceRequest {
  std::vector<bool> wanted;            // by column
  std::vector<std::int32_t> previous;  // by column: another that it is asked for its covariance with; -1: none
  std::vector<Matrix6> covariances;    // by column; zero where not wanted, or where the system was singular
  std::vector<Matrix6> with_previous;  // by column: E[xi xi_previous']; the same
};

SolverReport solve(Problem* problem, const SolverOptions& options, CovarianceRequest* covariance = nullptr);

}  // namespace relmap::rba
