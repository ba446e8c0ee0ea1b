// Text formatted as by printf.
#pragma once

#include <string>

namespace relmap {

// The text of any length that printf() would write. The compiler checks the arguments against the pattern.
[[gnu::format(printf, 1, 2)]] std::string printf_text(const char* pattern, ...);

}  // namespace relmap
