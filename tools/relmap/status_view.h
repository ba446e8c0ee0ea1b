// What `relmap status` shows: what needs attention, then how the daemon and its map are, on one screen.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/map_types.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

struct StatusMoment {
  client::DaemonStatus status;
  std::vector<client::RobotStatus> robots;
  std::set<SessionNumber> frozen;  // sessions that take nothing in
};

// What an operator should look at, most urgent first: where it is, and what is the matter.
std::vector<std::pair<std::string, std::string>> needs_attention(const StatusMoment& now);

// `all`: also what only somebody who looks for something wants: each share of memory, the journal's numbers, what the
// vocabulary was made of and under which terms.
void print_status(const StatusMoment& now, bool all, terminal::Console& console);

}  // namespace relmap::cli
