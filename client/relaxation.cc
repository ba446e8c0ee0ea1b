#include "client/relaxation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <deque>
#include <string>
#include <unordered_map>

#include "proto/linear/block_cholesky.h"

namespace relmap::client {
namespace {

constexpr double kMinDamping = 1e-9, kMaxDamping = 1e12;

// An edge between frames that are numbered from 0.
struct Link {
  int a = 0, b = 0;
  SE3 T_ba_measured;  // inverse of the measurement
  Matrix6 information;
  bool robust = false;
};

Status check_edge(const RelaxationEdge& edge, const std::unordered_map<FrameId, int>& number) {
  const auto name = [&] { return "edge " + edge.a.to_string() + " -> " + edge.b.to_string(); };
  if (!number.contains(edge.a) || !number.contains(edge.b))
    return {Reason::INVALID_ARGUMENT, name() + " leads out of the frames"};
  if (edge.a == edge.b) return {Reason::INVALID_ARGUMENT, name() + " joins a frame to itself"};
  if (!edge.T_ab.R.allFinite() || !edge.T_ab.t.allFinite() || !edge.covariance.allFinite())
    return {Reason::NOT_FINITE, name()};
  if ((edge.T_ab.R * edge.T_ab.R.transpose() - Matrix3::Identity()).norm() > 1e-6)
    return {Reason::BAD_ROTATION, name()};
  if (Eigen::LLT<Matrix6>(edge.covariance).info() != Eigen::Success ||
      !edge.covariance.isApprox(edge.covariance.transpose(), 1e-6))
    return {Reason::BAD_COVARIANCE, name()};
  return {};
}

// Numbers the frames from 0, in their order, and checks them and the edges.
Result<std::unordered_map<FrameId, int>> number_frames(const std::vector<FrameId>& frames,
                                                       const std::vector<RelaxationEdge>& edges) {
  std::unordered_map<FrameId, int> number;
  for (std::size_t k = 0; k < frames.size(); ++k)
    if (!number.emplace(frames[k], static_cast<int>(k)).second)
      return {Reason::INVALID_ARGUMENT, "frame " + frames[k].to_string() + " is given twice"};
  for (const RelaxationEdge& edge : edges)
    if (Status sound = check_edge(edge, number); !sound.ok()) return sound;
  return number;
}

struct Robust {
  double cost, weight;
};
Robust huber(double squared, bool robust, double width) {
  if (!robust || width <= 0 || squared <= width * width) return {squared, 1};
  const double sigmas = std::sqrt(squared);
  return {2 * width * sigmas - width * width, width / sigmas};
}

// A connected component with frames 0..n-1, of which frame 0 is fixed.
class Component {
 public:
  Component(std::vector<Link> links, int frames, const RelaxationOptions& options)
      : links_(std::move(links)), options_(options), poses_(frames) {
    start_breadth_first();
  }

  const std::vector<SE3>& poses() const { return poses_; }
  double cost() const { return cost_of(poses_); }
  int iterations() const { return iterations_; }
  bool converged() const { return converged_; }

  Status solve() {
    const int unknowns = static_cast<int>(poses_.size()) - 1;
    if (unknowns == 0) return {};
    std::vector<std::pair<int, int>> pairs;
    for (const Link& link : links_)
      if (link.a > 0 && link.b > 0) pairs.emplace_back(link.a - 1, link.b - 1);
    BlockCholesky system(unknowns, pairs);
    double cost = this->cost(), damping = 1e-6;
    converged_ = false;
    while (iterations_ < options_.max_iterations) {
      ++iterations_;
      const Eigen::VectorXd gradient = linearise(system);
      const Eigen::VectorXd diagonal = system.diagonal();
      double fallen = -1;
      while (fallen < 0) {  // until a step lowers the cost
        if (!(damping < kMaxDamping)) return finish_stuck(cost);
        if (system.factorise(damping * diagonal)) {
          const std::vector<SE3> moved = step(system.solve(-gradient));
          const double now = cost_of(moved);
          if (now <= cost) {
            fallen = cost - now;
            cost = now;
            poses_ = moved;
            damping = std::max(damping / 10, kMinDamping);
            break;
          }
        }
        damping *= 8;
      }
      if (fallen <= options_.relative_tolerance * (cost + 1e-12)) {
        converged_ = true;
        break;
      }
    }
    return {};
  }

 private:
  // No step lowers the cost: this is the minimum up to rounding errors, unless a number is not finite.
  Status finish_stuck(double cost) {
    if (!std::isfinite(cost)) return {Reason::NUMERICAL, "the cost of the pose graph is not finite"};
    converged_ = true;
    return {};
  }

  void start_breadth_first() {
    std::vector<std::vector<int>> at(poses_.size());
    for (std::size_t k = 0; k < links_.size(); ++k) {
      at[links_[k].a].push_back(static_cast<int>(k));
      at[links_[k].b].push_back(static_cast<int>(k));
    }
    std::vector<bool> reached(poses_.size(), false);
    std::deque<int> queue{0};
    reached[0] = true;
    while (!queue.empty()) {
      const int from = queue.front();
      queue.pop_front();
      for (const int k : at[from]) {
        const Link& link = links_[k];
        const int to = link.a == from ? link.b : link.a;
        if (reached[to]) continue;
        reached[to] = true;
        const SE3 step = link.a == from ? link.T_ba_measured.inverse() : link.T_ba_measured;
        poses_[to] = (poses_[from] * step).normalized();
        queue.push_back(to);
      }
    }
  }

  static Vector6 residual(const Link& link, const std::vector<SE3>& poses) {
    return (link.T_ba_measured * poses[link.a].inverse() * poses[link.b]).log();
  }

  double cost_of(const std::vector<SE3>& poses) const {
    double sum = 0;
    for (const Link& link : links_) {
      const Vector6 r = residual(link, poses);
      sum += huber(r.dot(link.information * r), link.robust, options_.loop_huber).cost;
    }
    return sum;
  }

  // Fills the normal equations; returns half the gradient.
  Eigen::VectorXd linearise(BlockCholesky& system) const {
    system.set_zero();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(6 * (static_cast<Eigen::Index>(poses_.size()) - 1));
    for (const Link& link : links_) {
      const Vector6 r = residual(link, poses_);
      const Matrix6 weight =
          huber(r.dot(link.information * r), link.robust, options_.loop_huber).weight * link.information;
      const Matrix6 J_b = right_jacobian_inverse(r);
      const Matrix6 J_a = -J_b * (poses_[link.b].inverse() * poses_[link.a]).adjoint();
      const int a = link.a - 1, b = link.b - 1;
      if (a >= 0) {
        system.add(a, a, J_a.transpose() * weight * J_a);
        gradient.segment<6>(6 * a) += J_a.transpose() * (weight * r);
      }
      if (b >= 0) {
        system.add(b, b, J_b.transpose() * weight * J_b);
        gradient.segment<6>(6 * b) += J_b.transpose() * (weight * r);
      }
      if (a >= 0 && b >= 0) system.add(a, b, J_a.transpose() * weight * J_b);
    }
    return gradient;
  }

  std::vector<SE3> step(const Eigen::VectorXd& by) const {
    std::vector<SE3> moved = poses_;
    for (std::size_t k = 1; k < moved.size(); ++k)
      moved[k] = (moved[k] * SE3::exp(by.segment<6>(6 * (static_cast<Eigen::Index>(k) - 1)))).normalized();
    return moved;
  }

  std::vector<Link> links_;
  const RelaxationOptions& options_;
  std::vector<SE3> poses_;
  int iterations_ = 0;
  bool converged_ = true;
};

// The component of each frame, numbered by their first frames.
std::vector<int> find_components(int frames, const std::vector<Link>& links, int& count) {
  std::vector<int> parent(frames);
  for (int k = 0; k < frames; ++k) parent[k] = k;
  const auto root = [&](int k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  for (const Link& link : links) {
    const int a = root(link.a), b = root(link.b);
    parent[std::max(a, b)] = std::min(a, b);  // so that the root is the first frame of its component
  }
  std::vector<int> component(frames);
  count = 0;
  for (int k = 0; k < frames; ++k) component[k] = root(k) == k ? count++ : component[root(k)];
  return component;
}

}  // namespace

Status check_graph(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges) {
  return number_frames(frames, edges).status();
}

Result<Relaxation> relax(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges,
                         const RelaxationOptions& options) {
  const auto number = number_frames(frames, edges);
  if (!number.ok()) return number.status();
  std::vector<Link> links;
  links.reserve(edges.size());
  for (const RelaxationEdge& edge : edges)
    links.push_back({number->at(edge.a), number->at(edge.b), edge.T_ab.inverse(),
                     Eigen::LLT<Matrix6>(edge.covariance).solve(Matrix6::Identity()),
                     edge.kind == RelaxationEdgeKind::kLoop});

  Relaxation out;
  const std::vector<int> component = find_components(static_cast<int>(frames.size()), links, out.components);
  std::vector<std::vector<int>> members(out.components);
  std::vector<int> place(frames.size());  // index of each frame within its component
  for (std::size_t k = 0; k < frames.size(); ++k) {
    place[k] = static_cast<int>(members[component[k]].size());
    members[component[k]].push_back(static_cast<int>(k));
  }
  std::vector<std::vector<Link>> inner(out.components);
  for (Link& link : links) {
    const int c = component[link.a];
    link.a = place[link.a];
    link.b = place[link.b];
    inner[c].push_back(link);
  }
  out.poses.resize(frames.size());
  for (int c = 0; c < out.components; ++c) {
    Component solver(std::move(inner[c]), static_cast<int>(members[c].size()), options);
    out.initial_cost += solver.cost();
    if (Status status = solver.solve(); !status.ok()) return status;
    out.final_cost += solver.cost();
    out.iterations = std::max(out.iterations, solver.iterations());
    out.converged = out.converged && solver.converged();
    for (std::size_t m = 0; m < members[c].size(); ++m) {
      const int k = members[c][m];
      out.poses[k] = {frames[k], solver.poses()[m], c};
    }
  }
  return out;
}

}  // namespace relmap::client
