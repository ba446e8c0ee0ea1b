#include "server/map/consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <unordered_map>

#include "server/place/map_points.h"

namespace relmap {

namespace {

constexpr double kChi2With6At99 = 16.812;
// What no covariance of the chain knows of: calibration, rounding, keyframes not quite where their pictures are.
constexpr double kFloorMetres = 0.01;
constexpr double kFloorRadians = 0.002;

struct Uncertain {
  SE3 T;
  Matrix6 covariance = Matrix6::Zero();

  Uncertain inverse() const { return {T.inverse(), inverse_covariance(T, covariance)}; }
  Uncertain operator*(const Uncertain& next) const {
    return {T * next.T, compound_covariance(covariance, next.T, next.covariance)};
  }
};

bool returns_home(const Uncertain& loop) {
  const Vector6 error = loop.T.log();
  Matrix6 covariance = loop.covariance;
  covariance.diagonal().head<3>().array() += kFloorMetres * kFloorMetres;
  covariance.diagonal().tail<3>().array() += kFloorRadians * kFloorRadians;
  const double chi2 = error.dot(covariance.ldlt().solve(error));
  return std::isfinite(chi2) && chi2 <= kChi2With6At99;
}

// Extends `set` by members of `open` (all of which agree with everyone in `set`) as far as it goes.
void extend(const std::vector<std::vector<bool>>& agree, std::vector<std::size_t>& set,
            const std::vector<std::size_t>& open, std::vector<std::size_t>& best) {
  if (set.size() > best.size()) best = set;
  if (set.size() + open.size() <= best.size()) return;
  for (std::size_t i = 0; i < open.size(); ++i) {
    std::vector<std::size_t> rest;
    for (std::size_t j = i + 1; j < open.size(); ++j)
      if (agree[open[i]][open[j]]) rest.push_back(open[j]);
    set.push_back(open[i]);
    extend(agree, set, rest, best);
    set.pop_back();
  }
}

}  // namespace

Neighbourhood test_consistency(const Graph& graph, const Edge& closure) {
  // Chains through motion that nothing sensed are not tested.
  const auto reached_from = [&](FrameId origin) {
    return along_odometry(graph, origin, kConsistencyReach, kConsistencyReach);
  };
  std::unordered_map<FrameId, Uncertain> matches;
  for (const PlacedFrame& placed : reached_from(closure.a))
    matches.emplace(placed.frame, Uncertain{placed.T_centre_frame, placed.covariance});
  const Uncertain T_match_query{closure.T_ab, closure.prior_covariance};

  Neighbourhood result;
  for (const PlacedFrame& query : reached_from(closure.b)) {
    if (query.frame == closure.b) continue;
    const Uncertain T_query_other{query.T_centre_frame, query.covariance};
    const auto hot = graph.hot(query.frame);
    for (const Edge& other : hot->edges) {
      if (other.kind != EdgeKind::kLoop || other.state == EdgeState::kRemoved) continue;
      const auto T_match_other = matches.find(other.a);
      if (T_match_other == matches.end()) continue;
      const Uncertain T_other_match_query{other.prior_T_ab, other.prior_covariance};
      // match -> query -> query' -> match' -> match
      const Uncertain loop =
          T_match_query * T_query_other * T_other_match_query.inverse() * T_match_other->second.inverse();
      if (returns_home(loop))
        result.agreeing.push_back(other.id);
      else if (other.state == EdgeState::kAccepted)
        result.conflicting.push_back(other.id);
    }
  }
  std::sort(result.agreeing.begin(), result.agreeing.end());
  std::sort(result.conflicting.begin(), result.conflicting.end());
  return result;
}

std::vector<EdgeId> largest_consistent_set(const Graph& graph, EdgeId closure, const std::vector<EdgeId>& agreeing) {
  // A clique among the nearest: enough to decide, and bounded.
  constexpr std::size_t kMost = 16;
  std::vector<EdgeId> members = agreeing;
  if (members.size() > kMost) members.erase(members.begin(), members.end() - kMost);
  const std::size_t n = members.size();
  std::vector<std::vector<bool>> agree(n, std::vector<bool>(n, false));
  for (std::size_t i = 0; i < n; ++i) {
    const auto edge = find_edge(graph, members[i]);
    for (std::size_t j = 0; j < n; ++j)
      agree[i][j] = std::find(edge->consistent_with.begin(), edge->consistent_with.end(), members[j]) !=
                    edge->consistent_with.end();
  }
  std::vector<std::size_t> set, open(n), best;
  for (std::size_t i = 0; i < n; ++i) open[i] = i;
  extend(agree, set, open, best);
  std::vector<EdgeId> result{closure};
  for (const std::size_t i : best) result.push_back(members[i]);
  std::sort(result.begin(), result.end());
  return result;
}

}  // namespace relmap
