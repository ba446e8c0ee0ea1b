#include "server/map/suspicion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "proto/base/number_text.h"

namespace relmap::map {

namespace {

using storage::ClosureDigest;
using storage::Verification;

// 0 up to `from`, 1 from `to` on, and linear between; `from` may be the larger.
double ramp(double value, double from, double to) { return std::clamp((value - from) / (to - from), 0.0, 1.0); }

bool is_seen(const ClosureDigest& c) {  // by a camera, in this map
  return c.verification == Verification::kStereo || c.verification == Verification::kPnP ||
         c.verification == Verification::kEpipolar;
}

// How far nothing confirms the closure from outside its two pictures: halved by each closure that agrees, and reduced
// by the robot's motion if that agrees and is known well enough to tell places apart: to a metre wholly, to ten metres
// not at all.
double alone(const ClosureDigest& c) {
  double left = std::exp2(-static_cast<double>(c.agreeing));
  if (c.tests.motion == storage::MotionSays::kAgrees) left *= 0.3 + 0.7 * ramp(c.tests.motion_sigma, 1, 10);
  return left;
}

// What the pictures show badly weighs less if the closure is confirmed from outside.
double unless_confirmed(const ClosureDigest& c) { return 0.3 + 0.7 * alone(c); }

double few_inliers(const ClosureDigest& c) {
  return is_seen(c) ? 0.4 * ramp(c.inliers, 80, 20) * unless_confirmed(c) : 0;
}

double poor_spread(const ClosureDigest& c) {
  return is_seen(c) ? 0.3 * ramp(c.spread, 0.25, 0.05) * unless_confirmed(c) : 0;
}

double improbable(const ClosureDigest& c) {
  return is_seen(c) ? 0.4 * ramp(c.probability, 0.9, 0.1) * unless_confirmed(c) : 0;
}

double rival(const ClosureDigest& c) {
  return c.inliers > 0 ? c.uniqueness.runner_up_inliers / static_cast<double>(c.inliers) : 0;
}
double runner_up(const ClosureDigest& c) {
  return c.uniqueness.known ? 0.6 * ramp(rival(c), 0.3, 0.9) * unless_confirmed(c) : 0;
}

constexpr int kEnoughCells = 8;  // fewer compared cells are no evidence
double changed_share(const ClosureDigest& c) {
  const auto& u = c.uniqueness;
  const double by_landmarks = u.compared >= kEnoughCells ? u.changed / static_cast<double>(u.compared) : 0;
  return u.known ? std::max<double>(u.differs, by_landmarks) : 0;
}
double changed(const ClosureDigest& c) { return 0.5 * ramp(changed_share(c), 0.25, 0.7) * unless_confirmed(c); }

bool motion_contradicts(const ClosureDigest& c) {
  return c.carried || c.tests.motion == storage::MotionSays::kContradicts || c.reason == Reason::CONTRADICTS_MOTION;
}
// One against none leaves it open which of the two is wrong; the more oppose it and the fewer agree, the less it is.
double opposed(const ClosureDigest& c) {
  const double against = c.tests.opposing, all = against + c.agreeing;
  return against > 0 ? 0.9 * against / all * (1 - std::exp2(-against)) : 0;
}
// Closures that contradict the odometry can agree only with their like, as those along two stretches that look alike
// do; so it takes three times as many to explain it by a ride.
double against_motion(const ClosureDigest& c) { return motion_contradicts(c) ? 0.8 * std::exp2(-c.agreeing / 3.0) : 0; }
double contradiction(const ClosureDigest& c) {
  const double once = c.was_contradicted ? 0.4 * std::max(0.2, alone(c)) : 0;
  // Those that agree are of the same two places, and mistook them likewise.
  const double alike = c.looks_alike ? 0.7 : 0;
  return 1 - (1 - opposed(c)) * (1 - std::max({against_motion(c), once, alike}));
}

double lonely(const ClosureDigest& c) { return c.verification == Verification::kCompounded ? 0 : 0.6 * alone(c); }

double tension(const ClosureDigest& c) { return 0.7 * ramp(c.tension, 3, 15); }

double unseen(const ClosureDigest& c) { return 0.7 * ramp(c.unseen, 0, 8); }

std::string percent(double share) { return number_text(100 * share) + " %"; }

std::string say_inliers(const ClosureDigest& c) {
  return std::to_string(c.inliers) + " points agree on its transform; a closure that stands by itself has 80";
}
std::string say_spread(const ClosureDigest& c) {
  return "the points that agree cover " + percent(c.spread) + " of the picture; a quarter raises no doubt";
}
std::string say_probability(const ClosureDigest& c) {
  return "appearance alone gave the place a probability of " + number_text(c.probability);
}
std::string say_rival(const ClosureDigest& c) {
  return std::to_string(c.uniqueness.runner_up_inliers) + " points fit at " + c.uniqueness.runner_up.to_string() +
         ", another place; " + std::to_string(c.inliers) + " fit here";
}
std::string say_changed(const ClosureDigest& c) {
  return percent(changed_share(c)) + " of what both pictures should show differs";
}
std::string say_contradiction(const ClosureDigest& c) {
  std::string text;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  if (c.tests.opposing > 0)
    add(counted_text(c.tests.opposing, "closure") + " contradicted it, " + std::to_string(c.agreeing) + " agree");
  if (c.carried)
    add("it says that the robot was carried: its odometry says otherwise");
  else if (motion_contradicts(c))
    add("the robot's own motion contradicts it");
  if (c.looks_alike)
    add("the daemon refused it since the two places look alike, and much differs there");
  else if (c.was_contradicted && !c.carried && !motion_contradicts(c))
    add("it was once refused or outvoted (see its history)");
  return text;
}
std::string say_lonely(const ClosureDigest& c) {
  std::string text = c.agreeing == 0 ? "no other closure agrees with it"
                                     : "only " + counted_text(c.agreeing, "other closure") +
                                           (c.agreeing == 1 ? " agrees with it" : " agree with it");
  if (c.tests.motion == storage::MotionSays::kAgrees)
    text += "; the robot's motion does, and tells the place to " + number_text(c.tests.motion_sigma) + " m";
  return text;
}
std::string say_tension(const ClosureDigest& c) {
  return "refinement moved it " + number_text(c.tension) + " standard deviations away from what was measured";
}
std::string say_unseen(const ClosureDigest& c) {
  return counted_text(c.unseen, "frame") + " after it saw nothing of what the map shows there";
}

struct Rule {
  DoubtKind kind;
  double (*weight)(const ClosureDigest&);
  std::string (*say)(const ClosureDigest&);
};
constexpr std::array<Rule, 9> kRules = {{
    {DoubtKind::kFewInliers, few_inliers, say_inliers},
    {DoubtKind::kPoorSpread, poor_spread, say_spread},
    {DoubtKind::kImprobable, improbable, say_probability},
    {DoubtKind::kRunnerUp, runner_up, say_rival},
    {DoubtKind::kChanged, changed, say_changed},
    {DoubtKind::kContradiction, contradiction, say_contradiction},
    {DoubtKind::kLonely, lonely, say_lonely},
    {DoubtKind::kTension, tension, say_tension},
    {DoubtKind::kUnseen, unseen, say_unseen},
}};

// Whether the closure is in force now because an operator put it there. What he removed or withdrew since is not.
bool is_by_operator(const ClosureDigest& c) {
  return c.state == storage::EdgeState::kAccepted && c.reason == Reason::ACCEPTED_BY_OPERATOR;
}

std::string remark_on(const ClosureDigest& c) {
  std::string text;
  const auto add = [&](const char* more) { text += (text.empty() ? "" : "; ") + std::string(more); };
  if (c.verification == Verification::kImported)
    add("it was imported: nothing is known of its points and of the pictures");
  else if (c.verification == Verification::kCompounded)
    add("it replaces a way through a deleted session: nothing tests it");
  else if (!c.uniqueness.known)
    add("whether another place looks the same was not measured");
  if (is_by_operator(c)) add("an operator put it into force");
  return text;
}

}  // namespace

double suspicion_value(const storage::ClosureDigest& closure) {
  if (closure.kind != storage::EdgeKind::kLoop) return 0;
  double right = 1;
  for (const Rule& rule : kRules) right *= 1 - rule.weight(closure);
  return std::isnan(right) ? 1 : 1 - right;
}

Suspicion suspicion_of(const storage::ClosureDigest& closure) {
  Suspicion result;
  if (closure.kind != storage::EdgeKind::kLoop) return result;
  result.value = suspicion_value(closure);
  for (const Rule& rule : kRules)
    if (const double weight = rule.weight(closure); weight > 0)
      result.doubts.push_back({rule.kind, weight, rule.say(closure)});
  std::stable_sort(result.doubts.begin(), result.doubts.end(),
                   [](const Doubt& l, const Doubt& r) { return l.weight > r.weight; });
  result.remark = remark_on(closure);
  return result;
}

}  // namespace relmap::map
