#include "client/relaxation.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

#include "proto/geometry/covariance.h"

namespace relmap::client {
namespace {

Vector6 random_vector(std::mt19937& random, double translation, double rotation) {
  std::normal_distribution<double> normal;
  Vector6 v;
  for (int k = 0; k < 6; ++k) v[k] = (k < 3 ? translation : rotation) * normal(random);
  return v;
}

Matrix6 diagonal_covariance(double translation, double rotation) {
  Vector6 d;
  d << Vector3::Constant(translation * translation), Vector3::Constant(rotation * rotation);
  return d.asDiagonal();
}

FrameId frame(int index) { return {1, static_cast<std::uint32_t>(index)}; }

// A circle driven 1.2 times with noisy odometry, and nearly exact loop edges where it meets itself.
struct Circle {
  std::vector<FrameId> frames;
  std::vector<SE3> truth;
  std::vector<RelaxationEdge> edges;

  explicit Circle(std::uint32_t seed, int lap = 100) {
    std::mt19937 random(seed);
    const double radius = lap * 0.2 / (2 * M_PI);
    for (int k = 0; k < lap * 12 / 10; ++k) {
      const double angle = 2 * M_PI * k / lap;
      SE3 pose;
      pose.R = so3_exp(Vector3(0, angle, 0));
      pose.t = Vector3(-radius * std::cos(angle), 0, radius * std::sin(angle));
      frames.push_back(frame(k));
      truth.push_back(pose);
    }
    for (int k = 1; k < static_cast<int>(truth.size()); ++k) connect(k - 1, k, RelaxationEdgeKind::kOdometry, random);
    for (int k = lap; k < static_cast<int>(truth.size()); k += 4)
      connect(k - lap, k, RelaxationEdgeKind::kLoop, random);
  }
  void connect(int a, int b, RelaxationEdgeKind kind, std::mt19937& random) {
    const SE3 T = truth[a].inverse() * truth[b] * SE3::exp(random_vector(random, 0.01, 0.004));
    edges.push_back({frames[a], frames[b], T, diagonal_covariance(0.01, 0.004), kind});
  }
  double error(const Relaxation& result) const {  // with the first frame at its true pose
    double sum = 0;
    for (std::size_t k = 0; k < truth.size(); ++k)
      sum += (truth[0] * result.poses[k].T_component_frame.t - truth[k].t).norm();
    return sum / static_cast<double>(truth.size());
  }
};

double cost(const std::vector<RelaxationEdge>& edges, const std::vector<SE3>& poses) {  // of Circle's frames
  double sum = 0;
  for (const RelaxationEdge& e : edges) {
    const Vector6 r = (e.T_ab.inverse() * poses[e.a.index].inverse() * poses[e.b.index]).log();
    sum += mahalanobis_squared(r, e.covariance);
  }
  return sum;
}

TEST(Relaxation, ConsistentEdgesGiveTheExactPoses) {
  Circle circle(1, 40);
  for (RelaxationEdge& e : circle.edges) e.T_ab = circle.truth[e.a.index].inverse() * circle.truth[e.b.index];
  const auto result = relax(circle.frames, circle.edges);
  ASSERT_TRUE(result.ok());
  EXPECT_LT(circle.error(*result), 1e-9);
  EXPECT_LT(result->final_cost, 1e-12);
  EXPECT_TRUE(result->converged);
}

TEST(Relaxation, SaysHowFarItIsAndEndsWhenItIsTold) {
  const Circle circle(5, 20);
  RelaxationOptions options;
  int asked = 0;
  options.proceed = [&](int iterations) {
    EXPECT_EQ(iterations, asked++);
    return Status();
  };
  const auto whole = relax(circle.frames, circle.edges, options);
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(asked, whole->iterations);
  options.proceed = [](int iterations) { return iterations < 1 ? Status() : Status(Reason::SHUTTING_DOWN, "enough"); };
  EXPECT_EQ(relax(circle.frames, circle.edges, options).reason(), Reason::SHUTTING_DOWN);
}

TEST(Relaxation, EndsWhereADenseGaussNewtonEnds) {
  const Circle circle(5, 20);
  RelaxationOptions options;
  options.loop_huber = 0;
  options.relative_tolerance = 1e-14;
  const auto result = relax(circle.frames, circle.edges, options);
  ASSERT_TRUE(result.ok());
  // Gauss-Newton with numerical Jacobians and a dense solve, starting at the true poses.
  const int n = static_cast<int>(circle.truth.size());
  std::vector<SE3> poses;
  for (const SE3& T : circle.truth) poses.push_back(circle.truth[0].inverse() * T);
  for (int iteration = 0; iteration < 10; ++iteration) {
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6 * n, 6 * n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(6 * n);
    for (const RelaxationEdge& e : circle.edges) {
      const auto residual = [&](const Vector6& xa, const Vector6& xb) -> Vector6 {
        return (e.T_ab.inverse() * (poses[e.a.index] * SE3::exp(xa)).inverse() * poses[e.b.index] * SE3::exp(xb)).log();
      };
      Eigen::Matrix<double, 6, 12> J;
      for (int k = 0; k < 12; ++k) {
        Eigen::Matrix<double, 12, 1> x = Eigen::Matrix<double, 12, 1>::Zero();
        x[k] = 1e-6;
        J.col(k) = (residual(x.head<6>(), x.tail<6>()) - residual(-x.head<6>(), -x.tail<6>())) / 2e-6;
      }
      const Matrix6 W = e.covariance.inverse();
      const Vector6 r = residual(Vector6::Zero(), Vector6::Zero());
      const int at[2] = {6 * static_cast<int>(e.a.index), 6 * static_cast<int>(e.b.index)};
      for (int p = 0; p < 2; ++p) {
        g.segment<6>(at[p]) += J.middleCols<6>(6 * p).transpose() * W * r;
        for (int q = 0; q < 2; ++q)
          H.block<6, 6>(at[p], at[q]) += J.middleCols<6>(6 * p).transpose() * W * J.middleCols<6>(6 * q);
      }
    }
    const int m = 6 * n - 6;
    const Eigen::VectorXd step = H.bottomRightCorner(m, m).ldlt().solve(-g.tail(m));
    for (int k = 1; k < n; ++k) poses[k] = poses[k] * SE3::exp(step.segment<6>(6 * (k - 1)));
  }
  EXPECT_NEAR(result->final_cost, cost(circle.edges, poses), 1e-6 * result->final_cost);
  for (int k = 0; k < n; ++k) EXPECT_LT((result->poses[k].T_component_frame.t - poses[k].t).norm(), 1e-5) << k;
}

TEST(Relaxation, LoopClosuresCorrectANoisyCircle) {
  double before = 0, after = 0, cost_per_edge = 0;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const Circle circle(seed);
    Circle open = circle;
    std::erase_if(open.edges, [](const RelaxationEdge& e) { return e.kind == RelaxationEdgeKind::kLoop; });
    const auto chain = relax(open.frames, open.edges), closed = relax(circle.frames, circle.edges);
    ASSERT_TRUE(chain.ok() && closed.ok());
    EXPECT_LT(chain->final_cost, 1e-9);
    before += open.error(*chain);
    after += circle.error(*closed);
    cost_per_edge += closed->final_cost / static_cast<double>(circle.edges.size()) / 5;
  }
  EXPECT_LT(after, 0.7 * before);
  // The expected cost is 6 per edge, times the share of redundant edges.
  EXPECT_GT(cost_per_edge, 0.1);
  EXPECT_LT(cost_per_edge, 1.0);
}

TEST(Relaxation, AWrongClosureBendsTheCircleLittle) {
  Circle circle(7);
  const double clean = circle.error(*relax(circle.frames, circle.edges));
  SE3 here;  // frames 20 and 60 are opposite each other
  circle.edges.push_back({frame(20), frame(60), here, diagonal_covariance(0.01, 0.004), RelaxationEdgeKind::kLoop});
  RelaxationOptions quadratic;
  quadratic.loop_huber = 0;
  const double robust = circle.error(*relax(circle.frames, circle.edges));
  const double bent = circle.error(*relax(circle.frames, circle.edges, quadratic));
  EXPECT_LT(robust - clean, 0.2 * (bent - clean));
  EXPECT_LT(robust, 0.1 * (circle.truth[20].t - circle.truth[60].t).norm());
}

TEST(Relaxation, ComponentsAreSolvedSeparately) {
  const Circle circle(2, 40);
  std::vector<FrameId> frames{{7, 3}};  // a frame without edges comes first
  frames.insert(frames.end(), circle.frames.begin(), circle.frames.end());
  std::vector<RelaxationEdge> edges = circle.edges;
  for (const FrameId id : circle.frames) frames.push_back({2, id.index});
  for (RelaxationEdge e : circle.edges) {
    e.a.session = e.b.session = 2;
    edges.push_back(e);
  }
  const auto alone = relax(circle.frames, circle.edges), together = relax(frames, edges);
  ASSERT_TRUE(alone.ok() && together.ok());
  ASSERT_EQ(together->components, 3);
  EXPECT_EQ(together->poses[0].component, 0);
  EXPECT_EQ(together->poses[0].frame, frames[0]);
  const std::size_t n = circle.frames.size();
  for (std::size_t k = 0; k < n; ++k) {
    EXPECT_EQ(together->poses[1 + k].component, 1);
    EXPECT_EQ(together->poses[1 + n + k].component, 2);
    EXPECT_EQ(together->poses[1 + k].T_component_frame.t, alone->poses[k].T_component_frame.t);
    EXPECT_EQ(together->poses[1 + n + k].T_component_frame.t, alone->poses[k].T_component_frame.t);
  }
}

TEST(Relaxation, EmptyAndSingleFramesAreFine) {
  EXPECT_TRUE(relax({}, {}).ok());
  const auto one = relax({frame(4)}, {});
  ASSERT_TRUE(one.ok());
  EXPECT_EQ(one->poses[0].T_component_frame.t, Vector3::Zero());
}

TEST(Relaxation, BadEdgesAreRefusedWithTheirReason) {
  const RelaxationEdge good{frame(0), frame(1), SE3{}, diagonal_covariance(0.01, 0.01), RelaxationEdgeKind::kOdometry};
  const auto reason = [&](auto change) {
    RelaxationEdge edge = good;
    change(edge);
    return relax({frame(0), frame(1)}, {edge}).reason();
  };
  EXPECT_EQ(reason([](auto&) {}), Reason::OK);
  EXPECT_EQ(reason([](auto& e) { e.b = frame(9); }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(reason([](auto& e) { e.b = e.a; }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(reason([](auto& e) { e.T_ab.t.x() = std::numeric_limits<double>::quiet_NaN(); }), Reason::NOT_FINITE);
  EXPECT_EQ(reason([](auto& e) { e.T_ab.R *= 2; }), Reason::BAD_ROTATION);
  EXPECT_EQ(reason([](auto& e) { e.covariance(2, 2) = -1; }), Reason::BAD_COVARIANCE);
  EXPECT_EQ(reason([](auto& e) { e.covariance(0, 5) = 5e-5; }), Reason::BAD_COVARIANCE);
  EXPECT_EQ(relax({frame(0), frame(0)}, {}).reason(), Reason::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace relmap::client
