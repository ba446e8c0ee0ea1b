// Cookies (RFC 6265).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relmap::console {

// The values of the cookie in a Cookie header, each once, in their order, at most kMaxSameCookies. There can be
// several: another server of the host, or an earlier console, may have set one of this name for another path.
inline constexpr std::size_t kMaxSameCookies = 8;
std::vector<std::string_view> cookies_in(std::string_view header, std::string_view name);

// A Set-Cookie header: for this host only, not shown to scripts, not sent with requests of other sites; until the
// browser is closed. An empty value takes the cookie away.
std::string set_cookie(std::string_view name, std::string_view value, bool secure);

// Whether a text can be the value of a cookie and of a header: of visible ASCII without quotes, commas, semicolons and
// backslashes; at most 4096.
bool is_cookie_value(std::string_view text);

// Whether they are the same, found out in a time that does not depend on where they differ.
bool equal_in_constant_time(std::string_view a, std::string_view b);

}  // namespace relmap::console
