// Text in UTF-8 (RFC 3629).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relmap {

// Removes the first code point from `text`, which must not be empty, and returns it. Returns nothing, and leaves `text`
// as it is, if it does not begin with a well-formed code point.
std::optional<char32_t> take_code_point(std::string_view& text);

bool is_utf8(std::string_view text);

// Whether `code` has Unicode's property White_Space.
bool is_white_space(char32_t code);

}  // namespace relmap
