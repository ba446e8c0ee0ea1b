#include "server/map/consistency.h"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "proto/geometry/covariance.h"
#include "server/map/carried_stretch.h"
#include "server/map/own_motion.h"
#include "server/map/sorted.h"
#include "server/map/uncertain.h"

namespace relmap::map {

namespace {

bool returns_home(const Uncertain& loop, const ConsistencyRules& rules) {
  const Vector6 error = loop.T.log();
  Matrix6 covariance = loop.covariance;
  covariance.diagonal().head<3>().array() += rules.floor_metres * rules.floor_metres;
  covariance.diagonal().tail<3>().array() += rules.floor_radians * rules.floor_radians;
  const double chi2 = mahalanobis_squared(error, covariance);
  return std::isfinite(chi2) && chi2 <= kChi2With6At99;
}

bool moved(const SE3& T, double min_change) { return T.t.norm() >= min_change || rotation_angle(T.R) >= min_change; }

// Searches the largest clique that extends `set` by members of `open`, each of which agrees with all of `set`.
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

MotionTest test_motion(const storage::Graph& graph, const storage::Edge& closure, const ConsistencyRules& rules) {
  const Drift drift{rules.drift_share, rules.drift_radians};
  MotionTest test;
  const auto own = own_motion(closure);
  if (!own) return test;

  const place::AcrossCarried measured = across_as_measured(graph, drift);
  std::set<EdgeId> carriers;
  bool met_carried = false;
  const auto as_measured = place::back_along_odometry(graph, closure.b, own->from, [&](const storage::Edge& step) {
    met_carried = true;
    const auto stretch = measured(step);
    if (!stretch) return stretch;
    test.carried.push_back({stretch->a.session, stretch->a.index, stretch->b.index});
    carriers.insert(step.carried_by.begin(), step.carried_by.end());
    return stretch;
  });
  // Every step as the odometry measured it.
  const auto as_sensed = !met_carried
                             ? as_measured
                             : place::back_along_odometry(graph, closure.b, own->from, [](const storage::Edge& step) {
                                 return std::optional<storage::Edge>(step);
                               });
  test.carriers.assign(carriers.begin(), carriers.end());
  const Uncertain T_from_query(own->T, own->covariance);
  if (const auto& way = as_measured ? as_measured : as_sensed)
    test.sigma = std::sqrt(std::max(0.0, Uncertain(*way, drift).covariance.topLeftCorner<3, 3>().trace()));
  const auto agrees = [&](const std::optional<place::PlacedFrame>& from) {
    return from && returns_home(T_from_query * Uncertain(*from, drift), rules);
  };
  if (!as_measured) {
    // The way across a carried stretch is not measured, or an end lies within one: only the odometry can refuse it.
    if (as_sensed && !agrees(as_sensed)) test.verdict = MotionVerdict::kContradicts;
    return test;
  }
  if (agrees(as_measured))
    test.verdict = !met_carried || agrees(as_sensed) ? MotionVerdict::kAgrees : MotionVerdict::kAsMeasured;
  else
    test.verdict = met_carried && agrees(as_sensed) ? MotionVerdict::kDenies : MotionVerdict::kContradicts;
  return test;
}

Neighbourhood test_consistency(const storage::Graph& graph, const storage::Edge& closure,
                               const ConsistencyRules& rules) {
  const Drift drift{rules.drift_share, rules.drift_radians};
  const place::AcrossCarried across = across_as_measured(graph, drift);
  const auto reached_from = [&](FrameId origin) {
    return place::along_odometry(graph, origin, rules.reach, rules.reach, across);
  };
  std::unordered_map<FrameId, Uncertain> matches;
  for (const place::PlacedFrame& placed : reached_from(closure.a))
    matches.emplace(placed.frame, Uncertain(placed, drift));
  const Uncertain T_match_query(closure.T_ab, closure.prior_covariance);
  std::vector<place::PlacedFrame> queries = reached_from(closure.b);
  std::stable_sort(queries.begin(), queries.end(), [](const auto& a, const auto& b) { return a.way < b.way; });

  const bool contradicts = contradicts_odometry(closure);
  // Closures that contradict the odometry are no witnesses for those that agree with it, and the other way round.
  const auto is_witness = [&](const storage::Edge& other) {
    if (other.state == storage::EdgeState::kRemoved) return true;
    if (other.reason == Reason::NOT_SEEN_BEYOND) return false;
    if (contradicts) return contradicts_odometry(other);
    if (other.carried.session != 0) return other.state == storage::EdgeState::kAccepted;
    return other.reason != Reason::CONTRADICTS_MOTION && other.reason != Reason::AMBIGUOUS_PLACE;
  };

  Neighbourhood result;
  std::size_t tested = 0;
  for (const place::PlacedFrame& query : queries) {
    if (!moved(query.T_centre_frame, rules.moved)) continue;
    if (tested >= kMaxTested) break;
    const Uncertain T_query_other(query, drift);
    const auto hot = graph.hot(query.frame);
    for (const storage::Edge& other : hot->edges) {
      // A bridge over a deleted session is no evidence: it may lead through motion that nothing sensed.
      if (other.kind != storage::EdgeKind::kLoop || other.verification == storage::Verification::kCompounded) continue;
      if (other.reason == Reason::REMOVED_ALONE) continue;  // the operator said nothing about closures that agree
      const bool witness = is_witness(other), removed = other.state == storage::EdgeState::kRemoved;
      if (!witness && other.state != storage::EdgeState::kAccepted) continue;
      const auto T_match_other = matches.find(other.a);
      if (T_match_other == matches.end()) continue;
      tested += removed ? 0 : 1;
      const Uncertain T_other_match_query(other.prior_T_ab, other.prior_covariance);
      // match -> query -> query' -> match' -> match
      const Uncertain loop =
          T_match_query * T_query_other * T_other_match_query.inverse() * T_match_other->second.inverse();
      if (!returns_home(loop, rules)) {
        if (other.state == storage::EdgeState::kAccepted) result.conflicting.push_back(other.id);
      } else if (witness) {
        (removed ? result.taken_out : result.agreeing).push_back(other.id);
      }
    }
  }
  std::sort(result.agreeing.begin(), result.agreeing.end());
  std::sort(result.conflicting.begin(), result.conflicting.end());
  std::sort(result.taken_out.begin(), result.taken_out.end());
  return result;
}

std::vector<EdgeId> largest_consistent_set(const storage::Graph& graph, EdgeId closure,
                                           const std::vector<EdgeId>& agreeing) {
  // A clique among the newest is enough to decide, and bounds the search.
  constexpr std::size_t kMaxMembers = 16;
  std::vector<EdgeId> members = agreeing;
  if (members.size() > kMaxMembers) members.erase(members.begin(), members.end() - kMaxMembers);
  const std::size_t n = members.size();
  std::vector<std::vector<bool>> agree(n, std::vector<bool>(n, false));
  for (std::size_t i = 0; i < n; ++i) {
    const auto edge = storage::find_edge(graph, members[i]);
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

}  // namespace relmap::map
