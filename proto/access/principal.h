// Who a credential was issued to: a role and a name.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "proto/base/status.h"

namespace relmap::access {

// Each role may do what those before it may. Readers ask; robots also send their own keyframes; operators edit the map
// and look after it.
enum class Role : std::uint8_t { kReader = 1, kRobot = 2, kOperator = 3 };

// "reader", "robot", "operator".
std::string_view role_name(Role role);
std::optional<Role> role_of(std::string_view name);

struct Principal {
  Role role = Role::kReader;
  std::string name;  // of a robot, as its keyframes have it; of people and programs, for display

  bool operator==(const Principal&) const = default;
};

// Who did something that no credentials tell, in events, histories, logs and the record of edits.
inline constexpr char kDaemonName[] = "relmapd";       // no caller did it
inline constexpr char kLocalName[] = "local";          // a caller at the daemon's own socket
inline constexpr char kAnonymousName[] = "anonymous";  // a caller at an address that asks for no credentials

// BAD_NAME unless credentials may have this name: a valid one (check_name()) that is none of those above.
Status check_principal_name(std::string_view name);

// As certificates have it among their subject alternative names (RFC 5280, 4.2.1.6): "relmap:robot:cart%201". Bytes of
// the name other than letters, digits and -._~ are percent-encoded (RFC 3986, 2.1).
std::string uri_of(const Principal& principal);
// nullopt if `uri` is none of these, or its name is no valid one (check_principal_name()).
std::optional<Principal> principal_of(std::string_view uri);

}  // namespace relmap::access
