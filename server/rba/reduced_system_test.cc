#include "server/rba/reduced_system.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace relmap::rba {
namespace {

using Pattern = std::vector<std::pair<std::int32_t, std::int32_t>>;

// A chain of blocks with one loop.
void couple_chain(int blocks, unsigned seed, ReducedSystem* system) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Pattern pattern;
  for (int p = 0; p + 1 < blocks; ++p) pattern.emplace_back(p + 1, p);
  pattern.emplace_back(blocks - 1, 0);
  system->reset(blocks, pattern);
  system->clear();
  for (int p = 0; p < blocks; ++p) {
    system->add(p, p, Matrix6::Identity());
    for (int k = 0; k < 6; ++k) system->right_side(p)[k] = normal(random);
  }
  for (const auto& [q, p] : pattern) {
    Eigen::MatrixXd J(8, 12);
    for (Eigen::Index k = 0; k < J.size(); ++k) J.data()[k] = normal(random);
    const Eigen::MatrixXd M = J.transpose() * J;
    system->add(p, p, M.topLeftCorner<6, 6>());
    system->add(q, q, M.bottomRightCorner<6, 6>());
    system->add(q, p, M.bottomLeftCorner<6, 6>());
  }
}

Eigen::VectorXd stacked(const std::vector<Vector6>& x) {
  Eigen::VectorXd whole(6 * x.size());
  for (std::size_t k = 0; k < x.size(); ++k) whole.segment<6>(6 * static_cast<Eigen::Index>(k)) = x[k];
  return whole;
}

TEST(ReducedSystem, SolvesSmallAndLargeSystemsAlike) {
  ReducedSystem system;
  std::vector<Vector6> x;
  std::vector<Matrix6> column;
  // Sizes go up and down, and a pattern comes again with other numbers.
  for (const int blocks : {8, 120, 3, ReducedSystem::kMaxDense, ReducedSystem::kMaxDense + 1, 120, 120}) {
    couple_chain(blocks, static_cast<unsigned>(blocks), &system);
    const Eigen::MatrixXd whole = system.dense();
    const Eigen::VectorXd b = system.dense_right_side();
    ASSERT_EQ(whole.rows(), 6 * blocks);
    EXPECT_LT((whole - whole.transpose()).norm(), 1e-12 * whole.norm());
    ASSERT_TRUE(system.factor(0));
    system.solve(&x);
    EXPECT_LT((whole * stacked(x) - b).norm(), 1e-9 * b.norm());
    const Eigen::MatrixXd inverse = whole.inverse();
    for (const int c : {0, blocks / 2, blocks - 1}) {
      system.inverse_column(c, &column);
      for (int r = 0; r < blocks; ++r)
        EXPECT_LT((column[r] - inverse.block<6, 6>(6 * r, 6 * c)).norm(), 1e-9) << blocks << " " << r << " " << c;
    }
    Eigen::MatrixXd damped = whole;
    damped.diagonal() *= 1.5;
    ASSERT_TRUE(system.factor(0.5));
    system.solve(&x);
    EXPECT_LT((damped * stacked(x) - b).norm(), 1e-9 * b.norm());
  }
}

TEST(ReducedSystem, RefusesWhatIsNotPositiveDefinite) {
  for (const int blocks : {8, 120}) {
    ReducedSystem system;
    couple_chain(blocks, 1, &system);
    system.add(3, 3, -1e3 * Matrix6::Identity());
    EXPECT_FALSE(system.factor(0)) << blocks;
    // And is as good as new for the next.
    couple_chain(blocks, 1, &system);
    EXPECT_TRUE(system.factor(0)) << blocks;
  }
}

}  // namespace
}  // namespace relmap::rba
