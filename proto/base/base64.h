// Bytes as text of letters that every protocol lets pass (RFC 4648, section 4).
#pragma once

#include <string>
#include <string_view>

namespace relmap {

// With padding, in one line.
std::string base64(std::string_view bytes);

}  // namespace relmap
