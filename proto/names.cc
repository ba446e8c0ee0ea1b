#include "proto/names.h"

#include <cstdint>
#include <string>

namespace relmap {

namespace {

// Takes one code point off the front of `text`; -1 if it is not well formed.
std::int32_t take_code_point(std::string_view& text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  const std::size_t length = lead < 0x80 ? 1 : lead >> 5 == 0x6 ? 2 : lead >> 4 == 0xe ? 3 : lead >> 3 == 0x1e ? 4 : 0;
  if (length == 0 || length > text.size()) return -1;
  std::int32_t code = length == 1 ? lead : lead & (0x7f >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if (byte(i) >> 6 != 0x2) return -1;
    code = code << 6 | (byte(i) & 0x3f);
  }
  static constexpr std::int32_t kShortest[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kShortest[length] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return -1;
  text.remove_prefix(length);
  return code;
}

bool is_control(std::int32_t code) { return code < 0x20 || (code >= 0x7f && code < 0xa0); }

}  // namespace

Status check_name(std::string_view what, std::string_view text) {
  const auto refuse = [&](const std::string& why) { return Status(Reason::BAD_NAME, std::string(what) + why); };
  if (text.empty()) return refuse(" is empty");
  if (text.size() > kMaxNameBytes)
    return refuse(" of " + std::to_string(text.size()) + " bytes; at most " + std::to_string(kMaxNameBytes));
  while (!text.empty()) {
    const std::int32_t code = take_code_point(text);
    if (code < 0) return refuse(" is not UTF-8");
    if (is_control(code)) return refuse(" holds a control character");
  }
  return {};
}

}  // namespace relmap
