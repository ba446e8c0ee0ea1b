// Text from elsewhere, as names of sessions and labels, in files of XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace relmap {

// `utf8` as text within an element or a quoted attribute: it cannot end either, and cannot turn around what stands
// beside it. What is not UTF-8, control characters, and those that set the direction of writing become U+FFFD; a line
// break or a tab becomes a space.
std::string markup_text(std::string_view utf8);

}  // namespace relmap
