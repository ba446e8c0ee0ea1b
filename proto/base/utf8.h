// Text in UTF-8 (RFC 3629).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relmap {

// Takes the first code point off `text`, which is not empty. None, and `text` stays as it is: it does not begin with a
// well-formed one.
std::optional<char32_t> take_code_point(std::string_view& text);

bool is_utf8(std::string_view text);

// Unicode's property White_Space: it takes room, and nothing is seen of it.
bool is_white_space(char32_t code);

}  // namespace relmap
