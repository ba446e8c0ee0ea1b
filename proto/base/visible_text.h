// Text from elsewhere, as names of sessions, labels and notes, made harmless where it is shown.
#pragma once

#include <string>
#include <string_view>

namespace relmap {

// `utf8` as it can be shown within a line: it does nothing to a terminal, and cannot turn around what stands beside it.
// What is not UTF-8, control characters, separators of lines, and characters that set the direction of writing (UAX #9)
// become U+FFFD; a line break or a tab becomes a space.
std::string visible_text(std::string_view utf8);

}  // namespace relmap
