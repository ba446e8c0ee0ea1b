// What is wrong with a robot that brings keyframes.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "client/map_types.h"

namespace relmap::cli {

std::set<SessionNumber> frozen_ones(const std::vector<client::Session>& sessions);

struct RobotTrouble {
  std::string name;     // a word for a column; empty: all is well
  std::string what;     // a sentence, for an operator who has to do something about it
  bool urgent = false;  // else it may be gone for good reasons
};

// The most urgent of what an operator should look at. `frozen`: sessions that take nothing in.
RobotTrouble trouble_of(const client::RobotStatus& robot, const std::set<SessionNumber>& frozen);

// "4 heard of in the last minute, 1 silent since"
std::string robots_text(const std::vector<client::RobotStatus>& robots);

}  // namespace relmap::cli
