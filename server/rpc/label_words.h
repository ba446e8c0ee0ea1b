// Labels found by words in them.
#pragma once

#include <string_view>

namespace relmap {

// For each word of `wanted` one of the label begins with it. Words are letters and digits, with all bytes beyond ASCII
// counted as letters; upper and lower case of a to z are the same. Without words: every label.
bool has_words(std::string_view label, std::string_view wanted);

}  // namespace relmap
