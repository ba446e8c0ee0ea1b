#include "server/route/transform.h"

#include <Eigen/Cholesky>
#include <deque>
#include <optional>

#include "server/route/trail.h"
#include "server/route/weight.h"
#include "storage/precision.h"

namespace relmap {

namespace {

// A step of the path and its error: T_step Exp(J xi) of the edge's own xi.
struct Step {
  EdgeRef edge;
  SE3 T;
  Matrix6 J;

  Step(EdgeRef walked_edge, bool forward)
      : edge(std::move(walked_edge)),
        T(walked(*edge, forward)),
        J(forward ? Matrix6(Matrix6::Identity()) : Matrix6(-edge->T_ab.adjoint())) {}
  bool is_odometry() const { return edge->id.ordinal == 0; }
};

// Covariance of the error of `step` (rows) with that of the one before on the path: zero unless they are neighbours.
Matrix6 common_covariance(const Step& step, const Step& before) {
  Matrix6 common = Matrix6::Zero();
  if (step.is_odometry() && before.is_odometry()) {
    const auto in_order = [](const Edge& edge, const Edge& previous) {
      return from_correlation(edge.correlation_with_previous, edge.covariance, previous.covariance);
    };
    if (step.edge->a == before.edge->b) common = in_order(*step.edge, *before.edge);
    if (before.edge->a == step.edge->b) common = in_order(*before.edge, *step.edge).transpose();
  }
  return step.J * common * before.J.transpose();
}

bool is_positive(const Matrix6& covariance) {
  return covariance.allFinite() && covariance.llt().info() == Eigen::Success;
}

Transform compound(const Graph& graph, const Path& path) {
  Transform result;
  Matrix6 independent = Matrix6::Zero();  // as if no two edges had anything in common
  bool correlated = true;                 // of all neighbours so far it is known what they have
  std::optional<Step> before;
  for (PathWalk walk(graph, path); const auto at = walk.next();) {
    if (!at->edge) break;
    const Step step(*at->edge, at->forward);
    const Matrix6 own = walked_covariance(*step.edge, at->forward);
    result.covariance = compound_covariance(result.covariance, step.T, own);
    independent = compound_covariance(independent, step.T, own);
    if (before) {
      const Matrix6 common = common_covariance(step, *before);
      const Matrix6 carried = common * step.T.inverse().adjoint().transpose();
      result.covariance += carried + carried.transpose();
      correlated = correlated && !common.isZero(0);
    }
    result.T_ab = result.T_ab * step.T;
    result.distance_m += length_m(*step.edge);
    ++result.edges;
    before.emplace(step);
  }
  // What only neighbours have in common may be more than the whole allows.
  if (!is_positive(result.covariance)) {
    result.covariance = independent;
    correlated = false;
  }
  result.compounded = result.edges > 2 || (result.edges == 2 && !correlated);
  result.T_ab = result.T_ab.normalized();
  result.covariance = 0.5 * (result.covariance + result.covariance.transpose()).eval();
  return result;
}

struct Offer {
  FrameId frame;
  EdgeId edge;  // by which it comes
};

}  // namespace

Result<Transform> transform_between(const Graph& graph, FrameId a, FrameId b, const WorkLimit& work) {
  for (const FrameId end : {a, b})
    if (!graph.hot(end)) return {Reason::NO_SUCH_FRAME, "no frame " + end.to_string()};
  Trail trail;
  std::deque<Offer> frontier{{a, {}}};
  while (!frontier.empty()) {
    const Offer next = frontier.front();
    frontier.pop_front();
    if (trail.contains(next.frame)) continue;
    const auto hot = graph.hot(next.frame);
    if (!hot) continue;
    if (trail.frames() >= work.max_frames)
      return {Reason::OUT_OF_REACH, b.to_string() + " was not found among the " + std::to_string(trail.frames()) +
                                        " frames nearest to " + a.to_string()};
    if (trail.frames() % kWorkStride == 0 && work.proceed)
      if (Status status = work.proceed(trail.memory_bytes() + frontier.size() * sizeof(Offer)); !status.ok())
        return status;
    const std::vector<Neighbour> steps = neighbours(graph, next.frame, *hot);
    trail.settle(next.frame, steps, next.edge);
    if (next.frame == b) {
      const auto path = trail.trace(graph, b, work, [](const Edge&) {});
      if (!path.ok()) return path.status();
      return compound(graph, *path);
    }
    for (const Neighbour& step : steps)
      if (!trail.contains(step.frame)) frontier.push_back({step.frame, step.edge});
  }
  return {Reason::NOT_CONNECTED, "no chain of accepted edges from " + a.to_string() + " to " + b.to_string()};
}

}  // namespace relmap
