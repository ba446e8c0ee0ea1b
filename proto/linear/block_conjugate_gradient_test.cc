#include "proto/linear/block_conjugate_gradient.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "proto/linear/block_cholesky.h"

namespace relmap {
namespace {

// Sums of J' J, as in a pose graph: chains of 40 blocks, and blocks that join them here and there.
struct System {
  static constexpr int kChain = 40, kBlocks = 4 * kChain;
  std::vector<std::pair<int, int>> pairs;
  std::vector<Matrix6> of_first, of_second;
  std::mt19937 random{5};

  System() {
    for (int i = 1; i < kBlocks; ++i)
      if (i % kChain != 0) pairs.emplace_back(i - 1, i);
    for (int k = 0; k < 30; ++k) {
      const int i = below(kBlocks), j = below(kBlocks);
      if (i != j) pairs.emplace_back(i, j);
    }
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const double stiff = pairs[k].first + 1 == pairs[k].second ? 10 : 1;
      of_first.push_back(stiff * (Matrix6::Identity() + 0.1 * Matrix6::Random()));
      of_second.push_back(-stiff * (Matrix6::Identity() + 0.1 * Matrix6::Random()));
    }
  }
  int below(int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); }

  template <typename Solver>
  void fill(Solver& solver) const {
    solver.set_zero();
    solver.add(0, 0, Matrix6::Identity());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const auto [i, j] = pairs[k];
      solver.add(i, i, of_first[k].transpose() * of_first[k]);
      solver.add(j, j, of_second[k].transpose() * of_second[k]);
      solver.add(i, j, of_first[k].transpose() * of_second[k]);
    }
  }
};

TEST(BlockConjugateGradient, AgreesWithTheDirectSolver) {
  const System system;
  BlockCholesky direct(System::kBlocks, system.pairs);
  BlockConjugateGradient iterative(System::kBlocks, system.pairs);
  iterative.add(0, 0, Matrix6::Constant(1e9));  // cleared by set_zero()
  system.fill(direct);
  system.fill(iterative);
  EXPECT_LT((iterative.diagonal() - direct.diagonal()).norm(), 1e-12 * direct.diagonal().norm());
  const Eigen::VectorXd b = Eigen::VectorXd::Random(6 * System::kBlocks),
                        extra = Eigen::VectorXd::Random(6 * System::kBlocks).cwiseAbs();
  for (const Eigen::VectorXd& damping : {Eigen::VectorXd(0 * extra), extra}) {
    ASSERT_TRUE(direct.factorise(damping));
    ASSERT_TRUE(iterative.factorise(damping));
    const Eigen::VectorXd expected = direct.solve(b), solved = iterative.solve(b, 1e-12, 1000);
    EXPECT_LT((solved - expected).norm(), 1e-7 * expected.norm());
    EXPECT_LT(iterative.iterations(), 250);
  }
  EXPECT_FALSE(iterative.factorise(Eigen::VectorXd::Constant(6 * System::kBlocks, -1e4)));
}

// Without blocks between chains the preconditioner is the inverse.
TEST(BlockConjugateGradient, ChainsAreSolvedInOneIteration) {
  System system;
  for (std::size_t k = system.pairs.size(); k-- > 0;)
    if (system.pairs[k].first + 1 != system.pairs[k].second) {
      system.pairs.erase(system.pairs.begin() + static_cast<std::ptrdiff_t>(k));
      system.of_first.erase(system.of_first.begin() + static_cast<std::ptrdiff_t>(k));
      system.of_second.erase(system.of_second.begin() + static_cast<std::ptrdiff_t>(k));
    }
  BlockConjugateGradient iterative(System::kBlocks, system.pairs);
  system.fill(iterative);
  ASSERT_TRUE(iterative.factorise(Eigen::VectorXd::Constant(6 * System::kBlocks, 1e-3)));
  (void)iterative.solve(Eigen::VectorXd::Random(6 * System::kBlocks), 1e-6, 1000);
  EXPECT_EQ(iterative.iterations(), 1);
}

// However few iterations there are, what is found lowers the quadratic form that the system minimises.
TEST(BlockConjugateGradient, EveryIterationLowersTheForm) {
  const System system;
  BlockCholesky direct(System::kBlocks, system.pairs);
  BlockConjugateGradient iterative(System::kBlocks, system.pairs);
  system.fill(direct);
  system.fill(iterative);
  ASSERT_TRUE(iterative.factorise(Eigen::VectorXd::Zero(6 * System::kBlocks)));
  const Eigen::MatrixXd dense = direct.dense();
  const Eigen::VectorXd b = Eigen::VectorXd::Random(6 * System::kBlocks);
  double last = 0;
  for (const int iterations : {1, 2, 4, 8, 16, 32}) {
    const Eigen::VectorXd x = iterative.solve(b, 0, iterations);
    const double form = 0.5 * x.dot(dense * x) - b.dot(x);
    EXPECT_LT(form, last) << iterations;
    last = form;
  }
  EXPECT_EQ(iterative.solve(Eigen::VectorXd::Zero(6 * System::kBlocks), 1e-3, 10).norm(), 0);
}

}  // namespace
}  // namespace relmap
