#include "proto/access/principal.h"

#include <array>
#include <utility>

#include "proto/base/names.h"
#include "proto/base/percent.h"

namespace relmap::access {

namespace {

constexpr std::array<std::pair<Role, std::string_view>, 3> kNames{
    {{Role::kReader, "reader"}, {Role::kRobot, "robot"}, {Role::kOperator, "operator"}}};
constexpr std::string_view kScheme = "relmap:";

}  // namespace

std::string_view role_name(Role role) {
  for (const auto& [known, name] : kNames)
    if (known == role) return name;
  return "unknown";
}

std::optional<Role> role_of(std::string_view name) {
  for (const auto& [role, known] : kNames)
    if (known == name) return role;
  return std::nullopt;
}

Status check_principal_name(std::string_view name) {
  if (Status valid = check_name("name", name); !valid.ok()) return valid;
  for (const std::string_view reserved : {kDaemonName, kLocalName, kAnonymousName})
    if (name == reserved)
      return {Reason::BAD_NAME, "'" + std::string(name) +
                                    "' is no name for credentials: in events and histories it means what was done "
                                    "without any; choose another"};
  return {};
}

std::string uri_of(const Principal& principal) {
  return std::string(kScheme).append(role_name(principal.role)).append(":").append(percent_encoded(principal.name));
}

std::optional<Principal> principal_of(std::string_view uri) {
  if (!uri.starts_with(kScheme)) return std::nullopt;
  uri.remove_prefix(kScheme.size());
  const std::size_t colon = uri.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const auto role = role_of(uri.substr(0, colon));
  auto name = percent_decoded(uri.substr(colon + 1));
  if (!role || !name || !check_principal_name(*name).ok()) return std::nullopt;
  return Principal{*role, std::move(*name)};
}

}  // namespace relmap::access
