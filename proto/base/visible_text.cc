#include "proto/base/visible_text.h"

#include "proto/base/utf8.h"

namespace relmap {

namespace {

// Among them is what XML does not allow.
bool is_invisible(char32_t code) {
  return code < 0x20 || (code >= 0x7F && code <= 0x9F) || code == 0x61C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069) || (code & 0xFFFE) == 0xFFFE;
}

}  // namespace

std::string visible_text(std::string_view utf8) {
  constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD
  std::string out;
  out.reserve(utf8.size());
  while (!utf8.empty()) {
    const std::string_view before = utf8;
    const auto code = take_code_point(utf8);
    if (!code) utf8.remove_prefix(1);
    if (code == U'\t' || code == U'\n')
      out += ' ';
    else if (!code || is_invisible(*code))
      out += kReplacement;
    else
      out += before.substr(0, before.size() - utf8.size());
  }
  return out;
}

}  // namespace relmap
