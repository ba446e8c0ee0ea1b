#include "client/linear_start.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "proto/linear/huber.h"

namespace relmap::client {
namespace {

using Link = PoseGraph::Link;
using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;  // a vector for each frame from 1 on

constexpr int kRounds = 3;  // of solving and weighing anew; the rotations become linear in these, too

// Minimises sum_k w_k |x_b - x_a - d_k|^2 with x_0 = 0.
class Network {
 public:
  explicit Network(const PoseGraph& graph) : graph_(graph), laplacian_(graph.frames - 1, graph.frames - 1) {}

  // False: the factorisation failed.
  bool solve(const std::vector<double>& weights, const std::vector<Vector3>& differences, Columns& x) {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(3 * weights.size());
    Columns right = Columns::Zero(graph_.frames - 1, 3);
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const int a = graph_.links[k].a - 1, b = graph_.links[k].b - 1;
      const double w = weights[k];
      if (a >= 0) {
        entries.emplace_back(a, a, w);
        right.row(a) -= w * differences[k].transpose();
      }
      if (b >= 0) {
        entries.emplace_back(b, b, w);
        right.row(b) += w * differences[k].transpose();
      }
      if (a >= 0 && b >= 0) entries.emplace_back(std::max(a, b), std::min(a, b), -w);
    }
    laplacian_.setFromTriplets(entries.begin(), entries.end());
    if (!analysed_) solver_.analyzePattern(laplacian_);
    analysed_ = true;
    solver_.factorize(laplacian_);
    if (solver_.info() != Eigen::Success) return false;
    x = solver_.solve(right);
    return x.allFinite();
  }

 private:
  const PoseGraph& graph_;
  Eigen::SparseMatrix<double> laplacian_;  // the lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver_;
  bool analysed_ = false;
};

double weight_of(const Link& link, double variance, double off, double huber) {
  return huber_weight(off / std::sqrt(variance), huber_corner(link, huber)) / variance;
}

}  // namespace

std::vector<SE3> start_linearly(const PoseGraph& graph, const std::vector<SE3>& start, double huber) {
  std::vector<SE3> poses = start;
  Network network(graph);
  std::vector<double> weights(graph.links.size());
  std::vector<Vector3> differences(graph.links.size());
  Columns x;
  const auto at = [&](int frame) -> SE3& { return poses[static_cast<std::size_t>(frame)]; };
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const Link& link = graph.links[k];
      const Vector3 off = so3_log(link.T_ab.R.transpose() * at(link.a).R.transpose() * at(link.b).R);
      weights[k] = weight_of(link, link.covariance.bottomRightCorner<3, 3>().trace() / 3, off.norm(), huber);
      differences[k] = -(at(link.b).R * off);
    }
    if (!network.solve(weights, differences, x)) return start;
    for (int i = 1; i < graph.frames; ++i) at(i).R = so3_exp(x.row(i - 1).transpose()) * at(i).R;
  }
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const Link& link = graph.links[k];
      differences[k] = at(link.a).R * link.T_ab.t;
      const double off = round == 0 ? 0 : (at(link.b).t - at(link.a).t - differences[k]).norm();
      weights[k] = weight_of(link, link.covariance.topLeftCorner<3, 3>().trace() / 3, off, huber);
    }
    if (!network.solve(weights, differences, x)) return start;
    for (int i = 1; i < graph.frames; ++i) at(i).t = x.row(i - 1).transpose();
  }
  for (SE3& pose : poses) pose = pose.normalized();
  return poses;
}

}  // namespace relmap::client
