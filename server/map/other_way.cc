#include "server/map/other_way.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "proto/base/number_text.h"
#include "proto/geometry/covariance.h"
#include "server/map/uncertain.h"
#include "storage/graph/forwarding_graph.h"

namespace relmap::map {

namespace {

// A way that tells where the other end lies only to so many metres or radians (one standard deviation) agrees with
// nearly everything.
constexpr double kVagueMetres = 10, kVagueRadians = 1;

// A graph in which one closure is not in force.
class Without final : public storage::ForwardingGraph<storage::Graph> {
 public:
  Without(const storage::Graph& graph, EdgeId closure) : ForwardingGraph(graph), closure_(closure) {
    if (const auto hot = graph.hot(closure.frame)) {
      auto changed = std::make_shared<storage::FrameHot>(*hot);
      if (storage::Edge* edge = changed->edge(closure)) edge->state = storage::EdgeState::kRemoved;
      changed_ = std::move(changed);
    }
  }
  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    return id == closure_.frame ? changed_ : ForwardingGraph::hot(id);
  }

 private:
  const EdgeId closure_;
  std::shared_ptr<const storage::FrameHot> changed_;
};

bool is_vague(const Matrix6& covariance) {
  return covariance.topLeftCorner<3, 3>().trace() > kVagueMetres * kVagueMetres ||
         covariance.bottomRightCorner<3, 3>().trace() > kVagueRadians * kVagueRadians;
}

// Whether closures besides this one say that the robot was carried on the way.
bool is_carried_by_others(const route::Transform& way, EdgeId closure) {
  return std::ranges::any_of(way.carried.list(), [&](const route::CarriedStretch& stretch) {
    return std::ranges::any_of(stretch.closures, [&](EdgeId id) { return id != closure; });
  });
}

std::string way_text(const route::Transform& way) {
  return "the way between its ends without it (" + counted_text(way.edges, "edge") + ", " +
         number_text(way.distance_m) + " m)";
}

}  // namespace

Result<OtherWay> other_way(const storage::Graph& graph, const storage::Edge& closure, const route::WorkLimit& work,
                           const ConsistencyRules& rules) {
  OtherWay result;
  route::WorkLimit bounded = work;
  bounded.max_frames = std::min(work.max_frames, kOtherWayFrames);
  auto found = route::transform_between(Without(graph, closure.id), closure.a, closure.b, bounded);
  if (found.reason() == Reason::NOT_CONNECTED || found.reason() == Reason::OUT_OF_REACH) {
    result.verdict = found.reason();
    result.message = found.reason() == Reason::NOT_CONNECTED
                         ? "nothing else joins its ends"
                         : "another way between its ends was not found within " + count_text(bounded.max_frames) +
                               " frames: too far to compare";
    return result;
  }
  if (!found.ok()) return found.status();
  route::Transform& way = result.way.emplace(*std::move(found));
  way.covariance =
      Uncertain({closure.b, way.T_ab, way.covariance, way.distance_m}, Drift{rules.drift_share, rules.drift_radians})
          .covariance;
  if (!storage::is_metric(closure.verification)) {
    result.verdict = Reason::NOT_STEREO;
    result.message = "the closure measured no metres, so nothing can be compared";
    return result;
  }
  const Uncertain measured(closure.prior_T_ab, closure.prior_covariance);
  const Uncertain difference = Uncertain(way.T_ab, way.covariance).inverse() * measured;
  Matrix6 covariance = difference.covariance;
  covariance.diagonal().head<3>().array() += rules.floor_metres * rules.floor_metres;
  covariance.diagonal().tail<3>().array() += rules.floor_radians * rules.floor_radians;
  const double chi2 = mahalanobis_squared(difference.T.log(), covariance);
  result.metres_apart = difference.T.t.norm();
  result.radians_apart = rotation_angle(difference.T.R);
  const bool comparable = std::isfinite(chi2);
  result.sigmas_apart = comparable ? std::sqrt(std::max(0.0, chi2)) : 0;
  const std::string numbers = way_text(way) + " leads " + number_text(result.metres_apart) + " m and " +
                              number_text(result.radians_apart) + " rad from where the closure says, " +
                              number_text(result.sigmas_apart) + " standard deviations";
  if (way.unmeasured.steps() > 0 || !comparable) {
    result.verdict = Reason::OUT_OF_REACH;
    result.message = way_text(way) + " passes " + counted_text(way.unmeasured.steps(), "step") +
                     " that nothing measured, so it says nothing";
  } else if (comparable && chi2 > kChi2With6At99) {
    const bool carried = is_carried_by_others(way, closure.id);
    result.verdict = carried ? Reason::CARRIED : Reason::CONTRADICTS_MOTION;
    result.message = numbers;
    if (carried) result.message += "; other closures say, too, that the robot was carried on it";
    if (!carried && closure.carried.session != 0)
      result.message += "; only this closure says that the robot was carried on it";
  } else if (is_vague(way.covariance)) {
    result.verdict = Reason::OUT_OF_REACH;
    result.message = way_text(way) + " tells where the other end lies to " +
                     number_text(std::sqrt(way.covariance.topLeftCorner<3, 3>().trace())) +
                     " m only, too vaguely to confirm anything";
  } else {
    result.verdict = Reason::OK;
    result.message = numbers;
  }
  return result;
}

}  // namespace relmap::map
