// What callers of each role may call.
#pragma once

#include <optional>
#include <string_view>

#include "proto/access/principal.h"

namespace relmap::rpc {

using access::Role;

// The lowest role that may call a method such as "Map.FindRoute"; nullopt if there is no such method.
std::optional<Role> required_role(std::string_view method);

// Whether calls of the method are written to the audit log: those that change the map or look after it.
bool is_audited(std::string_view method);

}  // namespace relmap::rpc
