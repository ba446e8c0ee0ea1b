#include "server/rba/levenberg_marquardt.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "server/rba/normal_equations.h"
#include "server/rba/problem_samples.h"

namespace relmap::rba {
namespace {

double cost_of(const Problem& problem) {
  std::vector<SE3> poses;
  problem.compose(&poses);
  return true_cost(problem, poses, 2);
}

TEST(LevenbergMarquardt, ConvergesWhereCentralDifferencesOfTheTrueCostVanish) {
  Problem problem = ProblemSample().make();
  SolverOptions options;
  options.max_iterations = 100;
  options.relative_decrease = 1e-15;
  const SolverReport report = LevenbergMarquardt().solve(&problem, options);
  ASSERT_FALSE(report.failed);
  EXPECT_LT(report.cost_after, report.cost_before);
  EXPECT_NEAR(report.cost_after, cost_of(problem), 1e-9 * report.cost_after);
  const double step = 1e-5;
  const auto expect_stationary = [&](double up, double down, double curvature_step) {
    // Newton's step to the minimum of the parabola through the three costs, in units of the step.
    const double here = cost_of(problem);
    const double slope = (up - down) / 2, curvature = up + down - 2 * here;
    EXPECT_GT(curvature, 0);
    EXPECT_LT(std::abs(slope / curvature) * curvature_step, 1e-6);
  };
  for (auto& edge : problem.edges) {
    if (edge.column < 0) continue;
    const SE3 T = edge.T_ab;
    for (int k = 0; k < 6; ++k) {
      Vector6 d = Vector6::Zero();
      d[k] = step;
      edge.T_ab = T * SE3::exp(d);
      const double up = cost_of(problem);
      edge.T_ab = T * SE3::exp(-d);
      const double down = cost_of(problem);
      edge.T_ab = T;
      expect_stationary(up, down, step);
    }
  }
  for (const auto& base : problem.bases)
    for (int l = base.first_landmark; l < base.end_free; l += 3) {
      Vector3& abr = problem.landmarks[l].abr;
      const Vector3 start = abr;
      for (int k = 0; k < 3; ++k) {
        abr[k] = start[k] + step;
        const double up = cost_of(problem);
        abr[k] = start[k] - step;
        const double down = cost_of(problem);
        abr = start;
        expect_stationary(up, down, step);
      }
    }
}

TEST(LevenbergMarquardt, NeverIncreasesTheCostHoweverFarOffTheStartIs) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    ProblemSample sample;
    sample.seed = seed;
    sample.state_noise = 0.05;
    Problem problem = sample.make();
    for (auto& landmark : problem.landmarks) landmark.abr.z() = std::max(landmark.abr.z(), 0.02);
    const SolverReport report = LevenbergMarquardt().solve(&problem, SolverOptions());
    if (report.failed) continue;  // began with a point behind a camera
    EXPECT_LE(report.cost_after, report.cost_before);
    EXPECT_NEAR(report.cost_after, cost_of(problem), 1e-6 * report.cost_after);
  }
}

TEST(LevenbergMarquardt, MovesNothingThatIsHeld) {
  Problem problem = ProblemSample().make();
  const Problem before = problem;
  ASSERT_FALSE(LevenbergMarquardt().solve(&problem, SolverOptions()).failed);
  for (std::size_t e = 0; e < problem.edges.size(); ++e)
    EXPECT_EQ(problem.edges[e].T_ab.t == before.edges[e].T_ab.t, problem.edges[e].column < 0);
  for (const auto& base : problem.bases)
    for (int l = base.end_free; l < base.end_landmark; ++l)
      EXPECT_EQ(problem.landmarks[l].abr, before.landmarks[l].abr);
}

TEST(LevenbergMarquardt, LeavesASingularProblemUnchanged) {
  Problem problem = ProblemSample().make();
  // An edge that moves, and that neither a measurement nor a prior holds.
  problem.edges.push_back({});
  problem.edges.back().column = problem.columns++;
  const Problem before = problem;
  const SolverReport report = LevenbergMarquardt().solve(&problem, SolverOptions());
  EXPECT_TRUE(report.failed);
  for (std::size_t e = 0; e < problem.edges.size(); ++e) {
    EXPECT_EQ(problem.edges[e].T_ab.R, before.edges[e].T_ab.R);
    EXPECT_EQ(problem.edges[e].T_ab.t, before.edges[e].T_ab.t);
  }
  for (std::size_t l = 0; l < problem.landmarks.size(); ++l)
    EXPECT_EQ(problem.landmarks[l].abr, before.landmarks[l].abr);
}

TEST(LevenbergMarquardt, LeavesTheProblemUnchangedWhenAMeasurementIsNaN) {
  Problem problem = ProblemSample().make();
  for (auto& observation : problem.observations) {
    observation.counted = true;
    observation.mono = false;
    observation.z.x() = std::nan("");
  }
  const Problem before = problem;
  EXPECT_TRUE(LevenbergMarquardt().solve(&problem, SolverOptions()).failed);
  for (std::size_t e = 0; e < problem.edges.size(); ++e) EXPECT_EQ(problem.edges[e].T_ab.t, before.edges[e].T_ab.t);
}

TEST(LevenbergMarquardt, CovariancesEqualTheInverseOfTheReducedSystem) {
  Problem problem = ProblemSample().make();
  SolverOptions options;
  options.max_iterations = 50;
  options.relative_decrease = 1e-14;
  CovarianceRequest request;
  request.wanted.assign(problem.columns, 0);
  request.wanted[1] = request.wanted[4] = 1;
  request.previous.assign(problem.columns, -1);
  request.previous[4] = 3;
  ASSERT_FALSE(LevenbergMarquardt().solve(&problem, options, &request).failed);
  std::vector<SE3> poses;
  problem.compose(&poses);
  NormalEquations equations;
  equations.reset(problem);
  ASSERT_TRUE(equations.assemble(problem, poses, options.huber, 0));
  const Eigen::MatrixXd inverse = equations.system().dense().inverse();
  const double factor = huber_covariance_factor(options.huber);
  for (const int c : {1, 4}) {
    const Matrix6 expected = factor * inverse.block<6, 6>(6 * c, 6 * c);
    EXPECT_LT((request.covariances[c] - expected).norm(), 1e-3 * expected.norm());
  }
  const Matrix6 expected = factor * inverse.block<6, 6>(6 * 4, 6 * 3);
  EXPECT_LT((request.with_previous[4] - expected).norm(), 1e-3 * expected.norm());
  EXPECT_EQ(request.with_previous[1], Matrix6::Zero());
  EXPECT_EQ(request.covariances[0], Matrix6::Zero());
}

}  // namespace
}  // namespace relmap::rba
