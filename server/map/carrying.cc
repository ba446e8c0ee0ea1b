#include "server/map/carrying.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "server/map/consistency.h"
#include "server/map/stops.h"

namespace relmap {

namespace {

// Views of one facade or shelf are hardly more evidence than one of them: what counts is how far they go on.
constexpr double kMetresOfALookAlike = 3;  // over which its likeness falls by e
constexpr double kMostBetween = 2;         // metres from one view to the next that they vouch for
constexpr double kMostMetres = 15;
// That a stop was a ride grows with its length: halts of tens of seconds are rarer than those of a few.
constexpr double kMostForStanding = 2;
constexpr double kNeeded = 3.5;  // nats that being carried at all is less likely than that a place looks like another
constexpr double kPerOpponent = 3;
constexpr double kClearRival = 0.4, kPerRival = 10;             // share of inliers, nats for all of them
constexpr double kUsualDifference = 0.35, kPerDifference = 12;  // share of the views, nats for all of it

// One step of the robot's own motion in the stretch that is looked at.
struct Step {
  std::uint32_t from, to;
  double stood_s;
  bool possible;  // the robot may have been carried along it
  bool stood;     // for most of its time
};

// What an operator put into force was not held against it, nor was what lies too far back.
bool agrees_with_odometry(const Edge& edge, SessionNumber session) {
  return edge.kind == EdgeKind::kLoop && edge.state == EdgeState::kAccepted && edge.carried.session == 0 &&
         edge.a.session == session && edge.b.session == session && edge.verification != Verification::kCompounded &&
         edge.b.index - edge.a.index <= kMotionReach && edge.reason != Reason::ACCEPTED_BY_OPERATOR;
}

// Between the newest place that was seen again and the oldest view of one.
struct Interval {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = 0;
  std::uint32_t newest = 0;  // query
};

// The robot's motion from the newest query back to the interval's beginning, the newest step first.
class Way {
 public:
  Way(const Graph& graph, const Interval& interval) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> covered;
    double metres = 0;
    for (FrameId at{interval.session, interval.newest}; at.index > interval.first;) {
      const auto hot = graph.hot(at);
      if (!hot || hot->edges.empty() || hot->edges.front().id.ordinal != 0) break;
      metres_.emplace(at.index, metres);
      for (const Edge& edge : hot->edges)
        if (agrees_with_odometry(edge, interval.session)) covered.emplace_back(edge.a.index, at.index);
      const Edge& motion = hot->edges.front();
      if (at.index <= interval.last)
        steps_.push_back(
            {motion.a.index, at.index, double{motion.standing_s}, motion.carried_by.empty(), stood(motion)});
      metres += motion.T_ab.t.norm();
      at = motion.a;
    }
    for (Step& step : steps_)
      step.possible = step.possible && std::none_of(covered.begin(), covered.end(), [&](const auto& closure) {
                        return closure.first <= step.from && closure.second >= step.to;
                      });
  }

  // From one view to the next, the newest first.
  double along(const std::vector<std::uint32_t>& views) const {
    double sum = 0;
    for (std::size_t i = 1; i < views.size(); ++i) {
      const auto from = metres_.find(views[i]), to = metres_.find(views[i - 1]);
      if (from != metres_.end() && to != metres_.end())
        sum += std::min(std::abs(from->second - to->second), kMostBetween);
    }
    return std::min(sum, kMostMetres);
  }

  // Standing still in one go for longest, where the robot may have been carried.
  void longest_stand(SessionNumber session, CarryingEvidence& evidence) const {
    for (std::size_t i = 0; i < steps_.size();) {
      double stood = 0;
      std::size_t end = i;
      for (; end < steps_.size() && steps_[end].possible && steps_[end].stood; ++end) stood += steps_[end].stood_s;
      if (stood > evidence.stood_s) {
        evidence.stood_s = stood;
        evidence.stretch = {session, steps_[end - 1].from, steps_[i].to};
      }
      i = std::max(end, i + 1);
    }
    if (evidence.stood_s < kShortestRide) evidence.stretch = {};
  }

 private:
  std::vector<Step> steps_;                 // of the interval
  std::map<std::uint32_t, double> metres_;  // from the newest query back to each frame
};

class Mean {
 public:
  void add(double value) { sum_ += value, ++count_; }
  double value() const { return count_ == 0 ? -1 : sum_ / count_; }

 private:
  double sum_ = 0;
  int count_ = 0;
};

}  // namespace

double CarryingEvidence::weight() const {
  if (stretch.session == 0) return -std::numeric_limits<double>::infinity();
  double nats = metres / kMetresOfALookAlike - kNeeded;
  nats += std::min(std::log(stood_s / kShortestRide), kMostForStanding);
  if (rival >= 0) nats -= kPerRival * std::max(rival - kClearRival, 0.0);
  if (differs >= 0) nats -= kPerDifference * std::max(differs - kUsualDifference, 0.0);
  return nats - kPerOpponent * opposed;
}

CarryingEvidence weigh_carrying(const Graph& graph, const std::vector<EdgeId>& closures) {
  CarryingEvidence evidence;
  Interval interval{closures.front().frame.session, 0, std::numeric_limits<std::uint32_t>::max(), 0};
  std::vector<std::uint32_t> views;
  Mean rival, differs;
  for (const EdgeId id : closures) {
    const auto closure = find_edge(graph, id);
    interval.first = std::max(interval.first, closure->a.index);
    interval.last = std::min(interval.last, closure->b.index);
    interval.newest = std::max(interval.newest, closure->b.index);
    if (views.empty() || views.back() != closure->b.index) views.push_back(closure->b.index);
    const Uniqueness& unique = closure->uniqueness;
    if (unique.known && closure->inliers > 0)
      rival.add(static_cast<double>(unique.runner_up_inliers) / closure->inliers);
    if (unique.known && unique.differs >= 0) differs.add(unique.differs);
  }
  evidence.views = static_cast<std::uint32_t>(views.size());
  evidence.rival = rival.value();
  evidence.differs = differs.value();
  if (interval.first >= interval.last) return evidence;  // no ride would explain all of them

  std::reverse(views.begin(), views.end());
  const Way way(graph, interval);
  evidence.metres = way.along(views);
  way.longest_stand(interval.session, evidence);
  for (std::uint32_t index = views.back(); index <= views.front(); ++index)
    if (const auto hot = graph.hot({interval.session, index}))
      evidence.opposed +=
          static_cast<std::uint32_t>(std::count_if(hot->edges.begin(), hot->edges.end(), [&](const Edge& edge) {
            return agrees_with_odometry(edge, interval.session);
          }));
  return evidence;
}

}  // namespace relmap
