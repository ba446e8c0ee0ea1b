// Who may call what.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relmap::rpc {

// Each may do what those before it may.
enum class Role : std::uint8_t { kReader = 1, kRobot = 2, kOperator = 3 };

struct Identity {
  std::string_view name;
  Role role = Role::kReader;
};

// The least role that may call "Map.FindRoute"; nullopt: no such method.
std::optional<Role> required_role(std::string_view method);

}  // namespace relmap::rpc
