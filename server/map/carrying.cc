#include "server/map/carrying.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "server/map/consistency.h"
#include "server/map/own_motion.h"
#include "server/map/stops.h"

namespace relmap::map {

namespace {

// Many views of one facade or shelf are hardly more evidence than one view; what counts is how far they extend.
constexpr double kMetresOfALookAlike = 3;  // two places that look alike go on doing so with probability 1/e per 3 m
constexpr double kMaxBetween = 2;          // metres from one view to the next that count at most
constexpr double kMaxMetres = 15;
// A longer stop is more likely to be a ride, since halts of tens of seconds are rarer than those of a few.
constexpr double kMaxForStanding = 2;     // nats
constexpr double kNeeded = 3.5;           // nats: prior log-odds of a place that looks alike against a ride
constexpr double kPerOpponent = 3;        // nats
constexpr std::uint32_t kMaxOpposed = 2;  // opponents counted at most: these outweigh any evidence for a ride
static_assert(kPerOpponent * kMaxOpposed > kMaxMetres / kMetresOfALookAlike + kMaxForStanding - kNeeded);
constexpr double kClearRival = 0.4, kPerRival = 10;             // share of inliers; nats per unit of share above it
constexpr double kUsualDifference = 0.35, kPerDifference = 12;  // share of the views; nats per unit of share above it

// One odometry edge of the interval.
struct Step {
  std::uint32_t from, to;
  double stood_s;
  bool possible;  // no closure in force says that the robot was carried along it
  bool stood;     // for most of its time
};

// Whether the closure may support the odometry between its ends: it is in force, and does not itself say that the robot
// was carried.
bool may_agree(const storage::Edge& edge, SessionNumber session) {
  return edge.kind == storage::EdgeKind::kLoop && edge.state == storage::EdgeState::kAccepted &&
         edge.carried.session == 0 && edge.b.session == session &&
         edge.verification != storage::Verification::kCompounded;
}

// The frames between the newest match, or frame before a stop, and the oldest query of a set of closures: a single ride
// that explains all of them lies there.
struct Interval {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t newest = 0;  // query

  bool empty() const { return first >= last; }
  void narrow(const storage::Edge& closure) {
    first = std::max(first, own_motion(closure)->from.index);
    last = std::min(last, closure.b.index);
    newest = std::max(newest, closure.b.index);
  }
};

// An uninterrupted time of standing still.
struct Stand {
  double seconds = 0;
  storage::FrameRange stretch;  // session 0: the robot never stood
};

// The robot's motion back to the interval's beginning, the newest step first, with the closures that lead over it. The
// robot was not carried along steps covered by a closure that agrees with the odometry (test_motion()). That test walks
// the whole odometry between the closure's ends, so it is made only where it matters, and once for each closure.
class Way {
 public:
  // `gone`: closures that do not count.
  Way(const storage::Graph& graph, const Interval& interval, const std::set<EdgeId>& gone = {})
      : graph_(graph), session_(interval.session) {
    double metres = 0;
    std::uint32_t oldest = interval.first;  // oldest frame that a closure leads to
    // Closures of newer queries may lead over the interval too.
    const auto session = graph.session(session_);
    const std::uint32_t last = std::max(interval.newest, session ? session->last : 0);
    for (FrameId at{session_, std::min(last, interval.newest + kMotionReach)}; at.index > oldest;) {
      const auto hot = graph.hot(at);
      const storage::Edge* motion = hot ? motion_to(*hot) : nullptr;
      if (!motion || !motion->in_graph() || motion->source == MotionSource::kUnsensed) unsensed_.push_back(at.index);
      if (hot && at.index > interval.first) {
        metres_.emplace(at.index, metres);
        for (const storage::Edge& edge : hot->edges) {
          if (!may_agree(edge, session_) || gone.contains(edge.id)) continue;
          const auto own = own_motion(edge);
          if (!own || (at.index > interval.newest && own->from.index >= interval.last)) continue;
          closures_.push_back({edge.id, own->from.index, at.index, std::nullopt});
          oldest = std::min(oldest, own->from.index);
        }
      }
      if (!motion) {
        if (at.index <= interval.newest) break;
        --at.index;
        continue;
      }
      if (at.index > interval.first && at.index <= interval.last)
        steps_.push_back(
            {motion->a.index, at.index, double{motion->standing_s}, motion->carried_by.empty(), stood(*motion)});
      metres += motion->T_ab.t.norm();
      at = motion->a;
    }
    // Of the closures that cover a step, the one with the oldest match comes first, so that few have to be tested.
    std::stable_sort(closures_.begin(), closures_.end(),
                     [](const Closure& x, const Closure& y) { return x.first < y.first; });
  }

  // Metres driven along the views, which come newest first.
  double along(const std::vector<std::uint32_t>& views) const {
    double sum = 0;
    for (std::size_t i = 1; i < views.size(); ++i) {
      const auto from = metres_.find(views[i]), to = metres_.find(views[i - 1]);
      if (from != metres_.end() && to != metres_.end())
        sum += std::min(std::abs(from->second - to->second), kMaxBetween);
    }
    return std::min(sum, kMaxMetres);
  }

  // The longest stand among the steps along which the robot may have been carried.
  Stand longest_stand() {
    Stand max_stand;
    for (std::size_t i = 0; i < steps_.size();) {
      double stood = 0;
      std::size_t end = i;
      for (; end < steps_.size() && steps_[end].stood && possible(steps_[end]); ++end) stood += steps_[end].stood_s;
      if (stood > max_stand.seconds) max_stand = {stood, {session_, steps_[end - 1].from, steps_[i].to}};
      i = std::max(end, i + 1);
    }
    return max_stand;
  }

  // The newest step along which the robot may have been carried; session 0: there is none.
  storage::FrameRange newest_possible() {
    const auto step = std::find_if(steps_.begin(), steps_.end(), [&](const Step& s) { return possible(s); });
    return step == steps_.end() ? storage::FrameRange{} : storage::FrameRange{session_, step->from, step->to};
  }

  // Number of closures of queries from `from` to `to` that agree with the odometry, at most `max_count`.
  std::uint32_t opposed(std::uint32_t from, std::uint32_t to, std::uint32_t max_count) {
    std::uint32_t count = 0;
    for (Closure& closure : closures_)
      if (count < max_count && closure.last >= from && closure.last <= to && agrees(closure)) ++count;
    return count;
  }

 private:
  struct Closure {
    EdgeId id;
    std::uint32_t first, last;
    std::optional<bool> agrees;  // with the odometry; nullopt: not tested yet
  };

  bool agrees(Closure& closure) {
    if (!closure.agrees) {
      const bool sensed = std::none_of(unsensed_.begin(), unsensed_.end(),
                                       [&](std::uint32_t to) { return to > closure.first && to <= closure.last; });
      closure.agrees =
          sensed && test_motion(graph_, *storage::find_edge(graph_, closure.id)).verdict == MotionVerdict::kAgrees;
    }
    return *closure.agrees;
  }
  bool possible(const Step& step) {
    return step.possible && std::none_of(closures_.begin(), closures_.end(), [&](Closure& closure) {
             return closure.first <= step.from && closure.last >= step.to && agrees(closure);
           });
  }

  const storage::Graph& graph_;
  const SessionNumber session_;
  std::vector<Step> steps_;                 // of the interval
  std::vector<Closure> closures_;           // those that may agree with the odometry, sorted by match
  std::vector<std::uint32_t> unsensed_;     // newer ends of steps that no sensor measured
  std::map<std::uint32_t, double> metres_;  // by frame: driven from there to the newest
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
  nats += std::min(std::log(stood_s / kMinRideSeconds), kMaxForStanding);
  if (rival >= 0) nats -= kPerRival * std::max(rival - kClearRival, 0.0);
  if (differs >= 0) nats -= kPerDifference * std::max(differs - kUsualDifference, 0.0);
  return nats - kPerOpponent * opposed;
}

CarryingEvidence weigh_carrying(const storage::Graph& graph, const std::vector<EdgeId>& closures) {
  CarryingEvidence evidence;
  Interval interval{closures.front().frame.session};
  std::vector<std::uint32_t> views;
  Mean rival, differs;
  for (const EdgeId id : closures) {
    const auto closure = storage::find_edge(graph, id);
    interval.narrow(*closure);
    if (views.empty() || views.back() != closure->b.index) views.push_back(closure->b.index);
    const storage::Uniqueness& unique = closure->uniqueness;
    if (unique.known && closure->inliers > 0)
      rival.add(static_cast<double>(unique.runner_up_inliers) / closure->inliers);
    if (unique.known && unique.differs >= 0) differs.add(unique.differs);
  }
  evidence.views = static_cast<std::uint32_t>(views.size());
  evidence.rival = rival.value();
  evidence.differs = differs.value();
  if (interval.empty()) return evidence;  // no ride would explain all of them

  std::reverse(views.begin(), views.end());
  Way way(graph, interval);
  evidence.metres = way.along(views);
  if (const Stand stand = way.longest_stand(); stand.seconds >= kMinRideSeconds) {
    evidence.stood_s = stand.seconds;
    evidence.stretch = stand.stretch;
    evidence.opposed = way.opposed(views.back(), views.front(), kMaxOpposed);
  }
  return evidence;
}

storage::FrameRange where_carried(const storage::Graph& graph, const std::vector<EdgeId>& closures,
                                  const std::set<EdgeId>& gone) {
  Interval interval{closures.front().frame.session};
  for (const EdgeId id : closures) interval.narrow(*storage::find_edge(graph, id));
  if (interval.empty()) return {};
  Way way(graph, interval, gone);
  const Stand stand = way.longest_stand();
  return stand.stretch.session != 0 ? stand.stretch : way.newest_possible();
}

}  // namespace relmap::map
