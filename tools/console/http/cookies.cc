#include "tools/console/http/cookies.h"

#include <openssl/crypto.h>

#include <algorithm>

namespace relmap::console {

namespace {

constexpr std::size_t kMaxValue = 4096;

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

}  // namespace

std::vector<std::string_view> cookies_in(std::string_view header, std::string_view name) {
  std::vector<std::string_view> found;
  while (!header.empty() && found.size() < kMaxSameCookies) {
    const std::size_t end = std::min(header.find_first_of(";,"), header.size());
    const std::string_view pair = trimmed(header.substr(0, end));
    header.remove_prefix(std::min(end + 1, header.size()));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos || pair.substr(0, equals) != name) continue;
    const std::string_view value = pair.substr(equals + 1);
    if (is_cookie_value(value) && std::find(found.begin(), found.end(), value) == found.end()) found.push_back(value);
  }
  return found;
}

std::string set_cookie(std::string_view name, std::string_view value, bool secure) {
  std::string header = std::string(name) + "=" + std::string(value) + "; Path=/; HttpOnly; SameSite=Strict";
  if (secure) header += "; Secure";
  if (value.empty()) header += "; Max-Age=0";
  return header;
}

bool is_cookie_value(std::string_view text) {
  return !text.empty() && text.size() <= kMaxValue && std::all_of(text.begin(), text.end(), [](char c) {
    return c > ' ' && c < '\x7f' && c != '"' && c != ',' && c != ';' && c != '\\';
  });
}

bool equal_in_constant_time(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace relmap::console
