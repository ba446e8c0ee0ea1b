// The output of `relmap status`: what needs attention, then the state of the daemon and its map, on one screen.
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
  std::set<SessionNumber> frozen;  // frozen sessions
};

// What an operator should look at, most urgent first: pairs of where it is and what is wrong.
std::vector<std::pair<std::string, std::string>> needs_attention(const StatusMoment& now);

// What waits for the daemon: records, lookups and since when, relaxations.
std::string waiting_text(const client::DaemonStatus& status);

// `all` adds details: each share of memory, the sequences of the journal, the vocabulary's source and licence.
void print_status(const StatusMoment& now, bool all, terminal::Console& console);

}  // namespace relmap::cli
