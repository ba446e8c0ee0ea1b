#include "tools/relmap/robot_trouble.h"

#include <algorithm>

#include "proto/keyframe/refusal_text.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

namespace {

RobotTrouble urgent(Reason reason, std::string what) {
  return {std::string(reason_name(reason)), std::move(what), true};
}

}  // namespace

std::set<SessionNumber> frozen_ones(const std::vector<client::Session>& sessions) {
  std::set<SessionNumber> frozen;
  for (const client::Session& session : sessions)
    if (session.state == client::SessionState::kFrozen) frozen.insert(session.number);
  return frozen;
}

std::string robot_name(const client::RobotStatus& robot) { return robot.robot.empty() ? "(no name)" : robot.robot; }

std::string robot_words(const client::RobotStatus& robot) {
  return "robot " + (robot.robot.empty() ? "of session " + robot.uuid.substr(0, 8) : robot.robot);
}

RobotTrouble trouble_of(const client::RobotStatus& robot, const std::set<SessionNumber>& frozen) {
  if (robot.blocked != Reason::OK) return urgent(robot.blocked, "its keyframes cannot be written to the journal");
  if (robot.not_taken.contains(Reason::SEQUENCE_CONFLICT))
    return urgent(Reason::SEQUENCE_CONFLICT, "two robots send keyframes of one session: has a spool been copied?");
  if (!robot.same_name.empty())
    return {"SAME_NAME",
            "another robot sends under the same name, for session " + robot.same_name.front() +
                ": give each a name of its own (--robot)",
            true};
  if (robot.refused.contains(Reason::SESSION_DELETED) || robot.not_taken.contains(Reason::SESSION_DELETED))
    return urgent(Reason::SESSION_DELETED, "it sends keyframes of a session that was deleted");
  if (robot.refused.contains(Reason::SESSION_FROZEN) && frozen.contains(robot.session))
    return urgent(Reason::SESSION_FROZEN, "it sends keyframes of a session that is frozen");
  if (!robot.refused.empty() && robot.session == 0)
    return {"not begun", "all that it sent was refused: " + refused_text(robot.refused.begin()->first), true};
  if (robot.dropped_messages > 0)
    return {std::to_string(robot.dropped_messages) + " dropped", "it sends messages faster than they can be read",
            true};
  if (robot.not_taken.contains(Reason::RATE_LIMITED))
    return urgent(Reason::RATE_LIMITED, "it sends more than the daemon takes from one robot");
  if (robot.silent)
    return {"silent", "not heard of for " + terminal::duration_text(robot.silent_s) + ", and its session has not ended",
            false};
  return {};
}

std::string refused_text(Reason reason) {
  const std::string_view why = refusal_text(reason);
  return std::string(reason_name(reason)) + (why.empty() ? "" : ", ") + std::string(why);
}

std::string counts_text(const client::ReasonCounts& counts, const std::string& none) {
  std::string text;
  for (const auto& [reason, count] : counts)
    text += (text.empty() ? "" : ", ") + count_text(count) + ' ' + std::string(reason_name(reason));
  return text.empty() ? none : text;
}

std::string robots_text(const std::vector<client::RobotStatus>& robots) {
  const auto silent = static_cast<std::size_t>(
      std::count_if(robots.begin(), robots.end(), [](const client::RobotStatus& robot) { return robot.silent; }));
  return count_text(robots.size() - silent) + " heard of in the last minute" +
         (silent ? ", " + count_text(silent) + " silent since" : "");
}

}  // namespace relmap::cli
