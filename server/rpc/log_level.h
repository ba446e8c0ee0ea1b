// The level of the log, which can be changed while the daemon runs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relmap::rpc {

// trace, debug, info, warning, error: each tells less than the one before.
const std::vector<std::string>& log_levels();

// The level in force, one of log_levels().
std::string log_level();

// Thread-safe. False, and nothing is changed, if there is no such level.
bool set_log_level(std::string_view level);

}  // namespace relmap::rpc
