// Labels found by words in them, or by how they begin.
#pragma once

#include <string_view>

namespace relmap::rpc {

// For each word of `wanted` one of the label begins with it. Words are letters and digits, with all bytes beyond ASCII
// counted as letters; upper and lower case of a to z are the same. Without words: every label.
bool has_words(std::string_view label, std::string_view wanted);

// Whether it begins so; upper and lower case of a to z are the same.
bool begins_with(std::string_view label, std::string_view prefix);

}  // namespace relmap::rpc
