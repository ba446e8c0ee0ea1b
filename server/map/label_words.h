// Finds labels by words in them or by how they begin.
#pragma once

#include <string_view>

namespace relmap::map {

// Whether, for each word of `wanted`, a word of the label begins with it; true if `wanted` has no words. Words consist
// of letters and digits, where all bytes beyond ASCII count as letters; the case of a to z is ignored.
bool has_words(std::string_view label, std::string_view wanted);

// Whether the label begins with `prefix`; the case of a to z is ignored.
bool begins_with(std::string_view label, std::string_view prefix);

}  // namespace relmap::map
