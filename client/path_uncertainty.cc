#include "client/path_uncertainty.h"

#include <cmath>
#include <limits>
#include <queue>
#include <unordered_map>

namespace relmap::client {

std::vector<double> position_sigmas(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges,
                                    FrameId root) {
  std::vector<double> sigmas(frames.size(), std::numeric_limits<double>::infinity());
  std::unordered_map<FrameId, std::size_t> number;
  for (std::size_t i = 0; i < frames.size(); ++i) number.emplace(frames[i], i);
  struct Step {
    std::size_t to = 0, edge = 0;
    bool forward = false;  // from the edge's a to its b
  };
  std::vector<std::vector<Step>> steps(frames.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto a = number.find(edges[e].a), b = number.find(edges[e].b);
    if (a == number.end() || b == number.end() || !edges[e].covariance.allFinite()) continue;
    steps[a->second].push_back({b->second, e, true});
    steps[b->second].push_back({a->second, e, false});
  }
  const auto start = number.find(root);
  if (start == number.end()) return sigmas;

  // Dijkstra's search by the variance of the position.
  std::vector<Matrix6> covariance(frames.size(), Matrix6::Zero());
  std::vector<double> variance(frames.size(), std::numeric_limits<double>::infinity());
  std::vector<bool> settled(frames.size(), false);
  using Open = std::pair<double, std::size_t>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  variance[start->second] = 0;
  open.emplace(0, start->second);
  while (!open.empty()) {
    const std::size_t at = open.top().second;
    open.pop();
    if (settled[at]) continue;
    settled[at] = true;
    sigmas[at] = std::sqrt(std::max(0.0, variance[at]));
    for (const Step& step : steps[at]) {
      if (settled[step.to]) continue;
      const RelaxationEdge& edge = edges[step.edge];
      const Matrix6 next = step.forward ? compound_covariance(covariance[at], edge.T_ab, edge.covariance)
                                        : compound_covariance(covariance[at], edge.T_ab.inverse(),
                                                              inverse_covariance(edge.T_ab, edge.covariance));
      const double traced = next.topLeftCorner<3, 3>().trace();
      if (!(traced < variance[step.to])) continue;
      variance[step.to] = traced;
      covariance[step.to] = next;
      open.emplace(traced, step.to);
    }
  }
  return sigmas;
}

}  // namespace relmap::client
