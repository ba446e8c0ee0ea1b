#include "tools/relmap/edge_words.h"

#include "tools/relmap/degrees.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

Result<EdgeId> edge_id(const std::string& text) {
  if (const auto id = EdgeId::parse(text)) return *id;
  return Status(Reason::INVALID_ARGUMENT,
                "'" + text + "' is no edge; an edge is written session:index/ordinal, as 3:120/1");
}

const char* explanation(Reason reason) {
  switch (reason) {
    case Reason::CONSISTENT:
      return "closures of neighbouring frames agree with it";
    case Reason::LONE:
      return "no other closure agrees with it yet";
    case Reason::INCONSISTENT:
      return "a larger set of closures contradicts it";
    case Reason::CONTRADICTS_MOTION:
      return "the robot's own motion contradicts it";
    case Reason::ACCEPTED_BY_OPERATOR:
      return "an operator put it into force";
    case Reason::CARRIED:
      return "other closures agree: the robot was carried before it saw this place";
    case Reason::BEYOND_DOUBT:
      return "its geometry is strong, and no other place comes near it";
    case Reason::LOOKS_ALIKE:
      return "the robot stood still in between, and pictures point to another place that looks alike: the robot may "
             "have "
             "been carried there";
    case Reason::NOT_SEEN_BEYOND:
      return "going on from there, the robot saw nothing of what the map shows: this is another place that looks alike";
    case Reason::AMBIGUOUS_PLACE:
      return "another place explains the picture about as well";
    case Reason::REMOVED_BY_OPERATOR:
      return "an operator took it out";
    case Reason::REMOVED_ALONE:
      return "an operator took out this one alone, without those that agree with it";
    case Reason::REMOVED_WITH_SET:
      return "it agrees with one that an operator took out";
    case Reason::SESSION_DELETED:
      return "it replaces the path through a session that was deleted";
    case Reason::MOTION:
      return "the robot's own motion";
    case Reason::DECLARED_GAP:
      return "it bridges keyframes that the robot gave up";
    default:
      return "";
  }
}

std::string ids_text(const std::vector<EdgeId>& ids, std::size_t max_ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids.size() > max_ids && i == max_ids / 2) {
      text += " ...";
      i = ids.size() - max_ids / 2;
    }
    text += ' ' + ids[i].to_string();
  }
  return text;
}

std::string stretch_text(FrameId first, FrameId last) {
  return "frames " + first.to_string() + ".." + last.to_string();
}

namespace {

template <typename Stretch>
std::string stretches_text(const std::vector<Stretch>& stretches) {
  std::string text;
  for (const Stretch& stretch : stretches)
    text += (text.empty() ? "" : ", ") + stretch_text(stretch.first, stretch.last);
  return text;
}

}  // namespace

std::string carried_text(const std::vector<client::CarriedStretch>& stretches) {
  if (stretches.empty()) return "";
  return (stretches.size() == 1 ? "through a stretch in which the robot was carried: "
                                : "through stretches in which the robot was carried: ") +
         stretches_text(stretches);
}

std::string unmeasured_text(const client::Unmeasured& unmeasured, double distance_m) {
  if (unmeasured.steps == 0) return "";
  return "a guess along " + counted_text(unmeasured.steps, "step") + " that nothing measured, " +
         fixed(unmeasured.distance_m, 2) + " of " + fixed(distance_m, 2) +
         " m: " + stretches_text(unmeasured.stretches);
}

std::string doubt_text(const client::Doubt& doubt) {
  return fixed(doubt.weight, 2) + " " + name_of(doubt.kind) + (doubt.message.empty() ? "" : ": " + doubt.message);
}

std::vector<client::Doubt> doubts_of(const client::Suspicion& suspicion) {
  std::vector<client::Doubt> doubts;
  for (const client::Doubt& doubt : suspicion.doubts)
    if (doubt.weight >= 0.005) doubts.push_back(doubt);
  return doubts;
}

std::string verdict_text(const client::MotionVerdict& verdict) {
  const char* said = "says nothing of it";
  switch (verdict.verdict) {
    case Reason::OK:
      said = "agrees with it";
      break;
    case Reason::CONTRADICTS_MOTION:
      said = "contradicts it";
      break;
    case Reason::CARRIED:
      said = "does not agree, since the robot was carried";
      break;
    case Reason::UNIMPLEMENTED:
      return "not told by this daemon";
    default:
      break;
  }
  std::string text = said;
  if (verdict.verdict != Reason::OK) text += " (" + std::string(reason_name(verdict.verdict)) + ")";
  if (!verdict.message.empty())
    text += ": " + verdict.message;
  else if (verdict.edges > 0)
    text += ": the way without it, " + counted_text(verdict.edges, "edge") + ", " + fixed(verdict.distance_m, 1) +
            " m, leads " + fixed(verdict.metres_apart, 2) + " m and " + fixed(kDegrees * verdict.radians_apart, 1) +
            " degrees from where it says, " + fixed(verdict.sigmas_apart, 1) + " sigmas";
  return text;
}

std::string agreements_text(const client::EdgeExplanation& explained) {
  constexpr std::size_t kMaxNamedClosures = 6;
  std::vector<EdgeId> agreeing, contradicting;
  for (const client::Agreement& other : explained.agreements)
    (other.agrees ? agreeing : contradicting).push_back(other.edge);
  std::string text;
  if (!agreeing.empty())
    text = counted_text(agreeing.size(), "closure") + (agreeing.size() == 1 ? " agrees" : " agree") +
           " with it:" + ids_text(agreeing, kMaxNamedClosures);
  if (!contradicting.empty())
    text += (text.empty() ? "" : "; ") + counted_text(contradicting.size(), "closure") +
            (contradicting.size() == 1 ? " contradicts it:" : " contradict it:") +
            ids_text(contradicting, kMaxNamedClosures);
  return text;
}

std::string no_points_text(const Status& missing) {
  if (missing.ok()) return "no points are known that both show";
  return "no points that both show: " + std::string(reason_name(missing.reason())) +
         (missing.message().empty() ? "" : ", " + missing.message());
}

bool was_verified(const client::Edge& edge) {
  using Kind = client::Verification;
  return edge.verification != Kind::kNone && edge.verification != Kind::kImported &&
         edge.verification != Kind::kCompounded;
}

std::string verification_text(const client::Edge& edge, const std::string& session) {
  switch (edge.verification) {
    case client::Verification::kNone:
      return "not verified";
    case client::Verification::kImported:
      return "imported with " + session + "; not verified here";
    case client::Verification::kCompounded:
      return "made of the edges through a session that was deleted; not verified itself";
    default:
      return "verified by " + std::string(name_of(edge.verification)) + ": " + counted_text(edge.inliers, "inlier") +
             " over " + fixed(100 * edge.spread, 0) + " % of the picture";
  }
}

std::string uniqueness_text(const client::Uniqueness& found) {
  std::string text = !found.runner_up ? "geometry confirms no other place"
                                      : "the best of the other places is " + found.runner_up->to_string() + ": " +
                                            std::to_string(found.runner_up_inliers) + " inliers, probability " +
                                            fixed(found.runner_up_probability, 3) + "; geometry confirms " +
                                            std::to_string(found.alike) + " other places";
  if (found.differs) text += "; " + fixed(100 * *found.differs, 0) + " % of what both should show differs";
  if (found.compared > 0)
    text += "; of " + std::to_string(found.compared) + " parts of the picture " + std::to_string(found.changed) +
            " do not show what was seen there";
  return text;
}

}  // namespace relmap::cli
