#include "server/rba/normal_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "proto/linear/huber.h"
#include "server/rba/measurement.h"
#include "server/rba/problem_samples.h"

namespace relmap::rba {
namespace {

constexpr double kHuber = 2;

// The slow and obvious way: the whole weighted Jacobian stacked, one block per measurement and edge of its chain
// (Sibley et al. 2010, 3.3), landmarks first; then the dense Schur complement.
struct Dense {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  Eigen::VectorXd dx;  // landmarks (3 each), then edges
  std::vector<int> landmark_column;
};

Dense direct(const Problem& problem, double lambda) {
  std::vector<SE3> poses;
  problem.compose(&poses);
  Dense dense;
  dense.landmark_column.assign(problem.landmarks.size(), -1);
  int landmarks = 0;
  for (const auto& base : problem.bases)
    for (int l = base.first_landmark; l < base.end_free; ++l) dense.landmark_column[l] = 3 * landmarks++;
  const Eigen::Index split = 3 * landmarks, size = split + 6 * problem.columns;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(
      static_cast<Eigen::Index>(3 * problem.observations.size() + landmarks + 6 * problem.edges.size()), size);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(J.rows());
  Eigen::Index row = 0;
  for (const auto& base : problem.bases) {
    for (int l = base.first_landmark; l < base.end_landmark; ++l) {
      const ProblemLandmark& point = problem.landmarks[l];
      const bool free = l < base.end_free;
      const double rho = point.abr.z();
      for (int o = point.first_observation; o < point.end_observation; ++o) {
        const ProblemObservation& observation = problem.observations[o];
        if (!observation.counted) continue;
        const StereoCamera& camera = problem.cameras[observation.camera];
        const SE3& T_ij = poses[observation.node];
        const Vector3 s = scaled_point(T_ij, point.abr);
        StereoPixel h = StereoPixel::Zero();
        EXPECT_TRUE(predict(camera, s, rho, &h));
        const Vector3 e = residual(observation.z, observation.mono, h);
        const double w = observation.information * huber_weight(std::sqrt(observation.information) * e.norm(), kHuber);
        Matrix3 dh_ds;
        dh_ds << camera.f / s.z(), 0, -camera.f * s.x() / (s.z() * s.z()),  //
            0, camera.f / s.z(), -camera.f * s.y() / (s.z() * s.z()),       //
            camera.f / s.z(), 0, -camera.f * (s.x() - rho * camera.baseline) / (s.z() * s.z());
        Matrix3 ds_dl;
        ds_dl << T_ij.R.col(0), T_ij.R.col(1), T_ij.t;
        Matrix3 dh_dl = dh_ds * ds_dl;
        dh_dl(2, 2) -= camera.f * camera.baseline / s.z();
        if (observation.mono) {
          dh_ds.row(2).setZero();
          dh_dl.row(2).setZero();
        }
        if (free) J.block<3, 3>(row, dense.landmark_column[l]) = std::sqrt(w) * dh_dl;
        for (int n = observation.node; problem.nodes[n].parent >= 0; n = problem.nodes[n].parent) {
          const ProblemNode& node = problem.nodes[n];
          const ProblemEdge& edge = problem.edges[node.edge];
          if (edge.column < 0) continue;
          // Forward: s = T_iy Exp(-xi) T_yj q; against: s = T_iy T_yx Exp(xi) T_xj q.
          const SE3& T_at_j = node.forward ? poses[n] : poses[node.parent];
          const Vector3 at = scaled_point(T_at_j, point.abr);
          const SE3 T_i_at = T_ij * T_at_j.inverse();
          Eigen::Matrix<double, 3, 6> generator;
          generator << rho * Matrix3::Identity(), -skew(at);
          if (node.forward) generator = -generator;
          J.block<3, 6>(row, split + 6 * edge.column) += std::sqrt(w) * dh_ds * T_i_at.R * generator;
        }
        r.segment<3>(row) = std::sqrt(w) * e;
        row += 3;
      }
      if (free && point.depth_prior) {
        J(row, dense.landmark_column[l] + 2) = 1 / kPriorInverseDepthSigma;
        r[row++] = (kPriorInverseDepth - rho) / kPriorInverseDepthSigma;
      }
    }
  }
  for (const auto& edge : problem.edges) {
    if (edge.column < 0 || !edge.prior) continue;
    const Vector6 e = (edge.prior_T_ab.inverse() * edge.T_ab).log();
    const double w = edge.prior_doubted ? huber_weight(std::sqrt(e.dot(edge.prior_information * e)), kHuber) : 1;
    const Eigen::MatrixXd root = std::sqrt(w) * Eigen::MatrixXd(Eigen::LLT<Matrix6>(edge.prior_information).matrixU());
    J.block<6, 6>(row, split + 6 * edge.column) = root * right_jacobian_inverse(e);
    r.segment<6>(row) = -root * e;
    row += 6;
  }
  Eigen::MatrixXd H = J.transpose() * J;
  const Eigen::VectorXd g = J.transpose() * r;
  H.diagonal().head(split) *= 1 + lambda;
  const Eigen::MatrixXd V_inverse = H.topLeftCorner(split, split).inverse();
  const Eigen::MatrixXd W = H.topRightCorner(split, 6 * problem.columns);
  dense.A = H.bottomRightCorner(6 * problem.columns, 6 * problem.columns) - W.transpose() * V_inverse * W;
  dense.b = g.tail(6 * problem.columns) - W.transpose() * V_inverse * g.head(split);
  dense.dx = H.ldlt().solve(g);
  return dense;
}

// Assembles, and compares with the direct way.
void expect_equal_to_direct(const Problem& problem, double lambda) {
  const Dense expected = direct(problem, lambda);
  std::vector<SE3> poses;
  problem.compose(&poses);
  NormalEquations equations;
  equations.reset(problem);
  ASSERT_TRUE(equations.assemble(problem, poses, kHuber, lambda));
  const Eigen::MatrixXd A = equations.system().dense();
  ASSERT_GT(A.rows(), 40);
  EXPECT_LT((A - expected.A).norm(), 1e-9 * expected.A.norm());
  EXPECT_LT((equations.system().dense_right_side() - expected.b).norm(), 1e-9 * expected.b.norm());
  // Block by block, so that the small blocks are held to it as well.
  for (int p = 0; p < problem.columns; ++p)
    for (int q = 0; q < problem.columns; ++q) {
      const double scale =
          std::sqrt(expected.A.block<6, 6>(6 * p, 6 * p).norm() * expected.A.block<6, 6>(6 * q, 6 * q).norm());
      ASSERT_LT((A.block<6, 6>(6 * p, 6 * q) - expected.A.block<6, 6>(6 * p, 6 * q)).norm(), 1e-9 * scale)
          << p << " " << q;
    }
}

class Assembly : public ::testing::TestWithParam<unsigned> {};

TEST_P(Assembly, EqualsTheDenseDirectOne) {
  ProblemSample sample;
  sample.seed = GetParam();
  sample.loop = sample.seed % 2 == 1;
  for (const double lambda : {0.0, 0.1}) expect_equal_to_direct(sample.make(), lambda);
}

// A system that is sparse: blocks must be where the pattern has them.
TEST(LargeAssembly, EqualsTheDenseDirectOne) {
  ProblemSample sample;
  sample.frames = ReducedSystem::kMaxDense + 20;
  sample.first_moving = 3;
  sample.end_moving = sample.frames - 3;
  sample.landmarks_per_frame = 4;
  const Problem problem = sample.make();
  ASSERT_GT(problem.columns, ReducedSystem::kMaxDense);
  expect_equal_to_direct(problem, 0);
}

TEST_P(Assembly, BackSubstitutionSolvesTheWholeSystem) {
  ProblemSample sample;
  sample.seed = GetParam();
  const Problem problem = sample.make();
  const Dense expected = direct(problem, 0);
  std::vector<SE3> poses;
  problem.compose(&poses);
  NormalEquations equations;
  equations.reset(problem);
  ASSERT_TRUE(equations.assemble(problem, poses, kHuber, 0));
  ASSERT_TRUE(equations.system().factor(0));
  std::vector<Vector6> dxi;
  equations.system().solve(&dxi);
  std::vector<Vector3> dl;
  equations.back_substitute(problem, dxi, &dl);
  for (std::size_t c = 0; c < dxi.size(); ++c) {
    const Vector6 step = expected.dx.tail(6 * problem.columns).segment<6>(6 * static_cast<Eigen::Index>(c));
    EXPECT_LT((dxi[c] - step).norm(), 1e-6 * step.norm()) << c;
  }
  for (std::size_t l = 0; l < dl.size(); ++l) {
    if (expected.landmark_column[l] < 0)
      EXPECT_EQ(dl[l], Vector3::Zero());
    else
      EXPECT_LT((dl[l] - expected.dx.segment<3>(expected.landmark_column[l])).norm(), 1e-6 * (dl[l].norm() + 1e-3));
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Assembly, ::testing::Values(1U, 2U, 3U, 4U));

TEST(TrueCost, IsInfiniteBehindTheCamera) {
  Problem problem = ProblemSample().make();
  for (auto& edge : problem.edges) edge.T_ab.t.z() += 30;
  std::vector<SE3> poses;
  problem.compose(&poses);
  EXPECT_EQ(true_cost(problem, poses, kHuber), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace relmap::rba
