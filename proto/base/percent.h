// Percent-encoding of text in URIs (RFC 3986, 2.1).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace relmap {

std::string percent_encoded(std::string_view text);  // all but letters, digits and "-._~"
// nullopt where a "%" is not followed by two hexadecimal digits.
std::optional<std::string> percent_decoded(std::string_view text);

}  // namespace relmap
