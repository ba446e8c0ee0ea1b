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
// Nor of what odometry has wrong all the way alike: standard deviations over its length.
constexpr double kDriftShare = 0.01;
constexpr double kDriftRadians = 0.0003;  // a metre

struct Uncertain {
  SE3 T;
  Matrix6 covariance = Matrix6::Zero();

  explicit Uncertain(const SE3& T_in = {}, const Matrix6& covariance_in = Matrix6::Zero())
      : T(T_in), covariance(covariance_in) {}
  // A way along the odometry.
  explicit Uncertain(const PlacedFrame& placed) : T(placed.T_centre_frame), covariance(placed.covariance) {
    covariance.diagonal().head<3>().array() += std::pow(kDriftShare * placed.way, 2);
    covariance.diagonal().tail<3>().array() += std::pow(kDriftRadians * placed.way, 2);
  }

  Uncertain inverse() const { return Uncertain(T.inverse(), inverse_covariance(T, covariance)); }
  Uncertain operator*(const Uncertain& next) const {
    return Uncertain(T * next.T, compound_covariance(covariance, next.T, next.covariance));
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

bool moved(const SE3& T) { return T.t.norm() >= kMoved || rotation_angle(T.R) >= kMoved; }

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
  for (const PlacedFrame& placed : reached_from(closure.a)) matches.emplace(placed.frame, Uncertain(placed));
  const Uncertain T_match_query(closure.T_ab, closure.prior_covariance);
  std::vector<PlacedFrame> queries = reached_from(closure.b);
  std::stable_sort(queries.begin(), queries.end(), [](const auto& a, const auto& b) { return a.way < b.way; });

  Neighbourhood result;
  std::size_t tested = 0;
  for (const PlacedFrame& query : queries) {
    if (!moved(query.T_centre_frame)) continue;
    if (tested >= kMostTested) break;
    const Uncertain T_query_other(query);
    const auto hot = graph.hot(query.frame);
    for (const Edge& other : hot->edges) {
      // A bridge over a session that was deleted may lead through motion that nothing sensed, and is no evidence.
      if (other.kind != EdgeKind::kLoop || other.reason == Reason::CONTRADICTS_MOTION ||
          other.verification == Verification::kCompounded)
        continue;
      const auto T_match_other = matches.find(other.a);
      if (T_match_other == matches.end()) continue;
      const bool removed = other.state == EdgeState::kRemoved;
      tested += removed ? 0 : 1;
      const Uncertain T_other_match_query(other.prior_T_ab, other.prior_covariance);
      // match -> query -> query' -> match' -> match
      const Uncertain loop =
          T_match_query * T_query_other * T_other_match_query.inverse() * T_match_other->second.inverse();
      if (returns_home(loop))
        (removed ? result.taken_out : result.agreeing).push_back(other.id);
      else if (other.state == EdgeState::kAccepted)
        result.conflicting.push_back(other.id);
    }
  }
  std::sort(result.agreeing.begin(), result.agreeing.end());
  std::sort(result.conflicting.begin(), result.conflicting.end());
  std::sort(result.taken_out.begin(), result.taken_out.end());
  return result;
}

bool contradicts_motion(const Graph& graph, const Edge& closure) {
  if (closure.a.session != closure.b.session || closure.a.index >= closure.b.index) return false;
  if (closure.b.index - closure.a.index > kMotionReach) return false;
  const auto match = back_along_odometry(graph, closure.b, closure.a);
  return match && !returns_home(Uncertain(closure.T_ab, closure.prior_covariance) * Uncertain(*match));
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
