// Levenberg-Marquardt for a relative bundle adjustment. A step is kept only if it does not increase the true cost;
// otherwise it is undone and the damping is raised. Plain Gauss-Newton diverges on landmarks of low disparity.
#pragma once

#include <cstdint>
#include <vector>

#include "server/rba/normal_equations.h"
#include "server/rba/problem.h"

namespace relmap::rba {

struct SolverOptions {
  int max_iterations = 6;           // linearisations
  double huber = 2;                 // corner of Huber's loss, in sigmas
  double relative_decrease = 1e-2;  // stops after a step that lowers the cost by less: the next would gain its square
};

struct SolverReport {
  bool failed = false;  // NUMERICAL: no system could be solved, or the cost is not finite. The problem is unchanged
  int iterations = 0;
  int accepted = 0;
  std::uint64_t work = 0;  // linearised observations
  double cost_before = 0, cost_after = 0;
};

// Covariances of columns to compute with the solution, from the inverse of the reduced system there.
struct CovarianceRequest {
  std::vector<char> wanted;            // by column; empty: none
  std::vector<std::int32_t> previous;  // by column: the column for its cross-covariance; -1: none
  // Results by column: zero where not wanted, or where the system was singular.
  std::vector<Matrix6> covariances;
  std::vector<Matrix6> with_previous;  // E[xi xi_previous']
};

// Reuses its memory from one problem to the next.
class LevenbergMarquardt {
 public:
  // Solves the problem in place.
  SolverReport solve(Problem* problem, const SolverOptions& options, CovarianceRequest* covariance = nullptr);

  // Problem::compose() of the problem last solved, at its solution.
  const std::vector<SE3>& poses() const { return poses_; }

 private:
  // A problem's variables before a step, so that the step can be undone.
  struct State {
    std::vector<SE3> edges;
    std::vector<Vector3> landmarks;

    void save(const Problem& problem);
    void restore(Problem* problem) const;
  };
  void take_covariances(double factor, CovarianceRequest* request);

  NormalEquations equations_;
  std::vector<SE3> poses_;
  std::vector<Vector6> dxi_;
  std::vector<Vector3> dl_;
  State start_, before_;
  std::vector<Matrix6> column_;  // a column of the inverse
};

}  // namespace relmap::rba
