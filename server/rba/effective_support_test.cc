#include "server/rba/effective_support.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "server/rba/problem_samples.h"

namespace relmap::rba {
namespace {

// A base with a chain of edges, each from the frame before, and one landmark for each number of observations at a node.
void add_chain(Problem* problem, const std::vector<std::int32_t>& edges, const std::vector<int>& observations) {
  ProblemBase base;
  base.first_node = static_cast<std::int32_t>(problem->nodes.size());
  base.first_landmark = base.end_free = static_cast<std::int32_t>(problem->landmarks.size());
  problem->nodes.emplace_back();
  for (std::size_t k = 0; k < edges.size(); ++k) {
    problem->nodes.push_back({static_cast<std::int32_t>(problem->nodes.size()) - 1, edges[k], true});
    for (int n = 0; n < observations[k]; ++n) {
      ProblemLandmark point;
      point.first_observation = static_cast<std::int32_t>(problem->observations.size());
      ProblemObservation seen{.z = StereoPixel(0, 0, 0)};
      seen.node = static_cast<std::int32_t>(problem->nodes.size()) - 1;
      problem->observations.push_back(seen);
      point.end_observation = static_cast<std::int32_t>(problem->observations.size());
      problem->landmarks.push_back(point);
    }
  }
  base.end_node = static_cast<std::int32_t>(problem->nodes.size());
  base.end_landmark = static_cast<std::int32_t>(problem->landmarks.size());
  problem->bases.push_back(base);
}

Problem with_edges(std::int32_t moving) {
  Problem problem;
  for (std::int32_t e = 0; e < moving; ++e) problem.edges.emplace_back().column = problem.columns++;
  return problem;
}

TEST(EffectiveSupport, AnEdgeThatIsMeasuredAloneHasAllItsObservations) {
  Problem problem = with_edges(1);
  add_chain(&problem, {0}, {30});
  EffectiveSupport support;
  EXPECT_NEAR(support.compute(problem)[0], 30, 1e-6);
  EXPECT_EQ(support.of(0), support.compute(problem)[0]);
}

TEST(EffectiveSupport, ObservationsThatUseTwoEdgesTogetherMeasureNeither) {
  Problem problem = with_edges(2);
  add_chain(&problem, {0, 1}, {0, 300});
  EffectiveSupport support;
  for (const double each : support.compute(problem)) EXPECT_LT(each, 0.01);
  // Ten observations of the frame between measure both: the first alone, the second as what is left of the sum.
  add_chain(&problem, {0}, {10});
  EXPECT_NEAR(support.compute(problem)[0], 10, 0.01);
  EXPECT_NEAR(support.compute(problem)[1], 1 / (1.0 / 10 + 1.0 / 300), 0.01);
}

TEST(EffectiveSupport, AnEdgeThatDoesNotMoveIsKnown) {
  Problem problem = with_edges(2);
  problem.edges[1].column = -1;
  problem.columns = 1;
  add_chain(&problem, {0, 1}, {0, 40});
  EffectiveSupport support;
  EXPECT_THAT(support.compute(problem), ::testing::ElementsAre(::testing::DoubleNear(40, 1e-6)));
}

TEST(EffectiveSupport, ObservationsThatDoNotCountMeasureNothing) {
  Problem problem = with_edges(1);
  add_chain(&problem, {0}, {30});
  for (int n = 0; n < 10; ++n) problem.observations[static_cast<std::size_t>(n)].counted = false;
  EffectiveSupport support;
  EXPECT_NEAR(support.compute(problem)[0], 20, 1e-6);
}

// The moving edges on the path to a node, with the sign of their direction.
Eigen::VectorXd moving_edges(const Problem& problem, std::int32_t node) {
  Eigen::VectorXd path = Eigen::VectorXd::Zero(problem.columns);
  for (auto n = static_cast<std::size_t>(node); problem.nodes[n].parent >= 0;
       n = static_cast<std::size_t>(problem.nodes[n].parent)) {
    const std::int32_t column = problem.edges[static_cast<std::size_t>(problem.nodes[n].edge)].column;
    if (column >= 0) path[column] += problem.nodes[n].forward ? 1 : -1;
  }
  return path;
}

// Against the definition, with a dense inverse.
TEST(EffectiveSupport, EqualsTheInverseOfTheSumOfPaths) {
  EffectiveSupport support;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    ProblemSample sample;
    sample.seed = seed;
    sample.frames = 14 + static_cast<int>(seed);
    sample.end_moving = sample.frames - 3;
    const Problem problem = sample.make();
    Eigen::MatrixXd L = 1e-3 * Eigen::MatrixXd::Identity(problem.columns, problem.columns);
    for (const ProblemObservation& seen : problem.observations) {
      if (!seen.counted) continue;
      const Eigen::VectorXd path = moving_edges(problem, seen.node);
      L += path * path.transpose();
    }
    const Eigen::VectorXd expected = L.inverse().diagonal().cwiseInverse();
    const std::vector<double>& found = support.compute(problem);
    ASSERT_EQ(found.size(), static_cast<std::size_t>(problem.columns));
    for (std::int32_t c = 0; c < problem.columns; ++c)
      EXPECT_NEAR(found[static_cast<std::size_t>(c)], expected[c] - 1e-3, 1e-6 * expected[c]) << seed << " " << c;
  }
}

TEST(EffectiveSupport, ALargeProblemCountsTheObservationsThatUseEachEdge) {
  const std::int32_t edges = EffectiveSupport::kMaxColumns + 1;
  Problem problem = with_edges(edges);
  for (std::int32_t e = 0; e + 1 < edges; e += 2) add_chain(&problem, {e, e + 1}, {1, 2});
  EffectiveSupport support;
  const std::vector<double>& found = support.compute(problem);
  EXPECT_EQ(found[0], 3);
  EXPECT_EQ(found[1], 2);
}

}  // namespace
}  // namespace relmap::rba
