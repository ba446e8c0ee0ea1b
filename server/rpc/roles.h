// The roles of callers, and what each may call.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relmap::rpc {

// Each role may do what those before it may.
enum class Role : std::uint8_t { kReader = 1, kRobot = 2, kOperator = 3 };

struct Identity {
  std::string_view name;
  Role role = Role::kReader;
};

// The lowest role that may call a method such as "Map.FindRoute"; nullopt if there is no such method.
std::optional<Role> required_role(std::string_view method);

}  // namespace relmap::rpc
