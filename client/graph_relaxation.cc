#include "client/graph_relaxation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "client/linear_start.h"
#include "proto/linear/block_cholesky.h"
#include "proto/linear/block_conjugate_gradient.h"

namespace relmap::client {
namespace {

constexpr double kMinDamping = 1e-9, kMaxDamping = 1e12;
// Of a step: up to a second. A city in which every street was driven several times takes more with 2,000 frames.
constexpr double kMaxDirectWork = 1e9;
// A step is solved for to this share of the residual: a better one gains nothing while the graph is not linear.
constexpr double kForcing = 0.1;
constexpr int kMaxInnerIterations = 100;
// Solved for so, the cost falls slowly at last, by what bends the whole a little: more precision is not worth the time.
constexpr double kIterativeTolerance = 1e-5;

using Link = PoseGraph::Link;

Eigen::VectorXd solve(const BlockCholesky& system, const Eigen::VectorXd& right_side) {
  return system.solve(right_side);
}
Eigen::VectorXd solve(BlockConjugateGradient& system, const Eigen::VectorXd& right_side) {
  return system.solve(right_side, kForcing, kMaxInnerIterations);
}

struct Robust {
  double cost, weight;
};
Robust huber(double squared, bool robust, double width) {
  if (!robust || width <= 0 || squared <= width * width) return {squared, 1};
  const double sigmas = std::sqrt(squared);
  return {2 * width * sigmas - width * width, width / sigmas};
}

// Frame 0 is fixed.
class Relaxer {
 public:
  Relaxer(const PoseGraph& graph, const RelaxationOptions& options, std::vector<SE3> start)
      : graph_(graph), options_(options), poses_(std::move(start)) {
    measured_.reserve(graph.links.size());
    for (const Link& link : graph.links)
      measured_.push_back({link.T_ab.inverse(), Eigen::LLT<Matrix6>(link.covariance).solve(Matrix6::Identity())});
  }

  // `system`: of the frames from 1 on.
  template <typename System>
  Result<RelaxedGraph> relax(System& system) {
    RelaxedGraph out;
    out.initial_cost = cost_of(poses_);
    if (Status status = iterate(system, out); !status.ok()) return status;
    out.poses = std::move(poses_);
    return out;
  }

 private:
  struct Measured {
    SE3 T_ba;
    Matrix6 information;
  };

  template <typename System>
  Status iterate(System& system, RelaxedGraph& out) {
    double cost = out.initial_cost, damping = 1e-6;
    out.converged = false;
    while (out.iterations < options_.max_iterations && !out.converged) {
      if (options_.proceed)
        if (Status going = options_.proceed(out.iterations); !going.ok()) return going;
      ++out.iterations;
      const Eigen::VectorXd gradient = linearise(system);
      const Eigen::VectorXd diagonal = system.diagonal();
      double fallen = -1;
      while (fallen < 0) {  // until a step lowers the cost
        if (!(damping < kMaxDamping)) {
          // None does: this is the minimum up to rounding errors, unless a number is not finite.
          if (!std::isfinite(cost)) return {Reason::NUMERICAL, "the cost of the pose graph is not finite"};
          fallen = 0;
          break;
        }
        if (system.factorise(damping * diagonal)) {
          std::vector<SE3> moved = step(solve(system, -gradient));
          const double now = cost_of(moved);
          if (now <= cost) {
            fallen = cost - now;
            cost = now;
            poses_ = std::move(moved);
            damping = std::max(damping / 10, kMinDamping);
            break;
          }
        }
        damping *= 8;
      }
      out.converged = fallen <= options_.relative_tolerance * (cost + 1e-12);
    }
    out.final_cost = cost;
    return {};
  }

  Vector6 residual(std::size_t k, const std::vector<SE3>& poses) const {
    const Link& link = graph_.links[k];
    return (measured_[k].T_ba * poses[static_cast<std::size_t>(link.a)].inverse() *
            poses[static_cast<std::size_t>(link.b)])
        .log();
  }

  double cost_of(const std::vector<SE3>& poses) const {
    double sum = 0;
    for (std::size_t k = 0; k < measured_.size(); ++k) {
      const Vector6 r = residual(k, poses);
      sum += huber(r.dot(measured_[k].information * r), graph_.links[k].robust, options_.loop_huber).cost;
    }
    return sum;
  }

  // Fills the normal equations; returns half the gradient.
  template <typename System>
  Eigen::VectorXd linearise(System& system) const {
    system.set_zero();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(6 * (Eigen::Index{graph_.frames} - 1));
    for (std::size_t k = 0; k < measured_.size(); ++k) {
      const Link& link = graph_.links[k];
      const Vector6 r = residual(k, poses_);
      const Matrix6& information = measured_[k].information;
      const Matrix6 weight = huber(r.dot(information * r), link.robust, options_.loop_huber).weight * information;
      const Matrix6 J_b = right_jacobian_inverse(r);
      const Matrix6 J_a =
          -J_b *
          (poses_[static_cast<std::size_t>(link.b)].inverse() * poses_[static_cast<std::size_t>(link.a)]).adjoint();
      const Matrix6 weighted_b = weight * J_b;
      const Vector6 pull = weight * r;
      const int a = link.a - 1, b = link.b - 1;
      if (a >= 0) {
        system.add(a, a, J_a.transpose() * weight * J_a);
        gradient.segment<6>(6 * a) += J_a.transpose() * pull;
      }
      if (b >= 0) {
        system.add(b, b, J_b.transpose() * weighted_b);
        gradient.segment<6>(6 * b) += J_b.transpose() * pull;
      }
      if (a >= 0 && b >= 0) system.add(a, b, J_a.transpose() * weighted_b);
    }
    return gradient;
  }

  std::vector<SE3> step(const Eigen::VectorXd& by) const {
    std::vector<SE3> moved = poses_;
    for (std::size_t k = 1; k < moved.size(); ++k)
      moved[k] = (moved[k] * SE3::exp(by.segment<6>(6 * (static_cast<Eigen::Index>(k) - 1)))).normalized();
    return moved;
  }

  const PoseGraph& graph_;
  const RelaxationOptions& options_;
  std::vector<SE3> poses_;
  std::vector<Measured> measured_;  // by link
};

std::vector<SE3> start_breadth_first(const PoseGraph& graph) {
  std::vector<std::vector<std::size_t>> at(static_cast<std::size_t>(graph.frames));
  for (std::size_t k = 0; k < graph.links.size(); ++k) {
    at[static_cast<std::size_t>(graph.links[k].a)].push_back(k);
    at[static_cast<std::size_t>(graph.links[k].b)].push_back(k);
  }
  std::vector<SE3> poses(at.size());
  std::vector<bool> reached(at.size(), false);
  std::deque<int> queue{0};
  reached[0] = true;
  while (!queue.empty()) {
    const int from = queue.front();
    queue.pop_front();
    for (const std::size_t k : at[static_cast<std::size_t>(from)]) {
      const Link& link = graph.links[k];
      const int to = link.a == from ? link.b : link.a;
      if (reached[static_cast<std::size_t>(to)]) continue;
      reached[static_cast<std::size_t>(to)] = true;
      poses[static_cast<std::size_t>(to)] =
          (poses[static_cast<std::size_t>(from)] * (link.a == from ? link.T_ab : link.T_ab.inverse())).normalized();
      queue.push_back(to);
    }
  }
  return poses;
}

}  // namespace

Result<RelaxedGraph> relax_graph(const PoseGraph& graph, const RelaxationOptions& options) {
  if (graph.frames == 1) return RelaxedGraph{{SE3()}};
  std::vector<std::pair<int, int>> pairs;
  for (const Link& link : graph.links)
    if (link.a > 0 && link.b > 0) pairs.emplace_back(link.a - 1, link.b - 1);
  const std::vector<SE3> start = start_breadth_first(graph);
  if (graph.frames <= options.max_direct)
    if (BlockCholesky system(graph.frames - 1, pairs); system.work() <= kMaxDirectWork)
      return Relaxer(graph, options, start).relax(system);
  BlockConjugateGradient system(graph.frames - 1, pairs);
  RelaxationOptions large = options;
  large.relative_tolerance = std::max(options.relative_tolerance, kIterativeTolerance);
  return Relaxer(graph, large, start_linearly(graph, start, options.loop_huber)).relax(system);
}

}  // namespace relmap::client
