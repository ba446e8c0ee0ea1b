#include "proto/base/names.h"

#include <string>

#include "proto/base/utf8.h"

namespace relmap {

namespace {

bool is_control(char32_t code) { return code < 0x20 || (code >= 0x7f && code < 0xa0); }

}  // namespace

Status check_line(std::string_view what, std::string_view text, std::size_t max_bytes) {
  const auto refuse = [&](const std::string& why) { return Status(Reason::BAD_NAME, std::string(what) + why); };
  if (text.size() > max_bytes)
    return refuse(" of " + std::to_string(text.size()) + " bytes; at most " + std::to_string(max_bytes));
  while (!text.empty()) {
    const auto code = take_code_point(text);
    if (!code) return refuse(" is not UTF-8");
    if (is_control(*code)) return refuse(" holds a control character");
  }
  return {};
}

Status check_name(std::string_view what, std::string_view text) {
  const auto refuse = [&](const std::string& why) { return Status(Reason::BAD_NAME, std::string(what) + why); };
  if (text.empty()) return refuse(" is empty");
  if (Status line = check_line(what, text, kMaxNameBytes); !line.ok()) return line;
  bool blank = true;
  while (!text.empty()) blank = is_white_space(*take_code_point(text)) && blank;
  if (blank) return refuse(" is nothing but white space");
  return {};
}

}  // namespace relmap
