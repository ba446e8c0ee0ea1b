// What is wrong with a robot that brings keyframes.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "client/map_types.h"

namespace relmap::cli {

// The sessions that are frozen.
std::set<SessionNumber> frozen_ones(const std::vector<client::Session>& sessions);

// "cart"; "(no name)" of one of which nothing is known but the session that it sends.
std::string robot_name(const client::RobotStatus& robot);
// "robot cart"; "robot of session 0f1e2d3c" (the beginning of its uuid).
std::string robot_words(const client::RobotStatus& robot);

struct RobotTrouble {
  std::string name;     // a word for a table; empty: all is well
  std::string what;     // a sentence for the operator
  bool urgent = false;  // false: it may have a good reason, as of a robot that was switched off
};

// The most urgent trouble of a robot. `frozen`: the frozen sessions.
RobotTrouble trouble_of(const client::RobotStatus& robot, const std::set<SessionNumber>& frozen);

// "TIME_AHEAD, its time is more than a day ahead of the server's clock": why a keyframe was refused.
std::string refused_text(Reason reason);

// "3 CORRUPT, 1 BAD_SIZE"; `none` if there are none.
std::string counts_text(const client::ReasonCounts& counts, const std::string& none);

// "4 heard of in the last minute, 1 silent since"
std::string robots_text(const std::vector<client::RobotStatus>& robots);

}  // namespace relmap::cli
