#include "server/route/transform.h"

#include <deque>

#include "server/route/trail.h"
#include "server/route/weight.h"
#include "storage/graph/compounded_chain.h"

namespace relmap::route {

namespace {

Transform compound(const storage::Graph& graph, const Path& path) {
  Transform result;
  storage::CompoundedChain chain;
  for (PathWalk walk(graph, path); const auto at = walk.next();) {
    if (!at->edge) break;
    chain.append(**at->edge, at->forward);
    result.distance_m += length_m(**at->edge);
    result.carried.add(**at->edge);
    result.unmeasured.add(**at->edge);
  }
  result.T_ab = chain.T().normalized();
  result.covariance = chain.covariance();
  result.edges = chain.edges();
  result.compounded = chain.edges() > 2 || (chain.edges() == 2 && !chain.is_correlated());
  return result;
}

struct Reached {
  FrameId frame;
  EdgeId edge;  // by which the frame is reached
};

}  // namespace

Result<Transform> transform_between(const storage::Graph& graph, FrameId a, FrameId b, const WorkLimit& work) {
  for (const FrameId end : {a, b})
    if (!graph.hot(end)) return {Reason::NO_SUCH_FRAME, "no frame " + end.to_string()};
  Trail trail;
  std::deque<Reached> frontier{{a, {}}};
  while (!frontier.empty()) {
    const Reached next = frontier.front();
    frontier.pop_front();
    if (trail.contains(next.frame)) continue;
    const auto hot = graph.hot(next.frame);
    if (!hot) continue;
    if (trail.frames() >= work.max_frames)
      return {Reason::OUT_OF_REACH, b.to_string() + " was not found among the " + std::to_string(trail.frames()) +
                                        " frames nearest to " + a.to_string()};
    if (trail.frames() % kWorkStride == 0 && work.proceed)
      if (Status status = work.proceed(trail.memory_bytes() + frontier.size() * sizeof(Reached)); !status.ok())
        return status;
    const std::vector<storage::Neighbour> steps = storage::neighbours(graph, next.frame, *hot);
    trail.settle(next.frame, steps, next.edge);
    if (next.frame == b) {
      const auto path = trail.trace(graph, b, work, [](const storage::Edge&) {});
      if (!path.ok()) return path.status();
      return compound(graph, *path);
    }
    for (const storage::Neighbour& step : steps)
      if (!trail.contains(step.frame)) frontier.push_back({step.frame, step.edge});
  }
  return {Reason::NOT_CONNECTED, "no chain of accepted edges from " + a.to_string() + " to " + b.to_string()};
}

}  // namespace relmap::route
