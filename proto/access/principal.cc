#include "proto/access/principal.h"

#include <array>
#include <utility>

#include "proto/base/hex.h"
#include "proto/base/names.h"

namespace relmap::access {

namespace {

constexpr std::array<std::pair<Role, std::string_view>, 3> kNames{
    {{Role::kReader, "reader"}, {Role::kRobot, "robot"}, {Role::kOperator, "operator"}}};
constexpr std::string_view kScheme = "relmap:";

bool is_unreserved(unsigned char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
         c == '_' || c == '~';
}

std::optional<std::string> decode(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const int high = hex_digit(text[i + 1]), low = hex_digit(text[i + 2]);
    if (high < 0 || low < 0) return std::nullopt;
    decoded += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return decoded;
}

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

std::string uri_of(const Principal& principal) {
  std::string uri(kScheme);
  uri.append(role_name(principal.role)).append(":");
  for (const char c : principal.name) {
    const auto byte = static_cast<std::uint8_t>(c);
    if (is_unreserved(byte))
      uri += c;
    else
      uri.append("%").append(hex(ByteSpan(&byte, 1)));
  }
  return uri;
}

std::optional<Principal> principal_of(std::string_view uri) {
  if (!uri.starts_with(kScheme)) return std::nullopt;
  uri.remove_prefix(kScheme.size());
  const std::size_t colon = uri.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const auto role = role_of(uri.substr(0, colon));
  auto name = decode(uri.substr(colon + 1));
  if (!role || !name || !check_name("name", *name).ok()) return std::nullopt;
  return Principal{*role, std::move(*name)};
}

}  // namespace relmap::access
