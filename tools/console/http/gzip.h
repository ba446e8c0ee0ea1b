// Compression of answers (RFC 1952).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace relmap::console {

enum class Effort : int { kQuick = 1, kBest = 9 };

// nullopt if it would not save a tenth.
std::optional<std::string> gzip(std::string_view bytes, Effort effort);

// Whether an Accept-Encoding header names this encoding ("gzip", "br"), and not with a weight of 0.
bool accepts(std::string_view header, std::string_view encoding);

// Whether content of this type is worth the attempt.
bool may_compress(std::string_view type);

}  // namespace relmap::console
