#include "server/rpc/log_level.h"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace relmap::rpc {

const std::vector<std::string>& log_levels() {
  static const std::vector<std::string> levels{"trace", "debug", "info", "warning", "error"};
  return levels;
}

std::string log_level() {
  const auto name = spdlog::level::to_string_view(spdlog::get_level());
  return {name.data(), name.size()};
}

bool set_log_level(std::string_view level) {
  const auto& levels = log_levels();
  if (std::find(levels.begin(), levels.end(), level) == levels.end()) return false;
  spdlog::set_level(spdlog::level::from_str(std::string(level)));
  return true;
}

}  // namespace relmap::rpc
