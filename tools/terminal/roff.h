// Text for manual pages: roff with the macros of man(7).
#pragma once

#include <string>
#include <vector>

namespace relmap::terminal {

// As it stands, within a line or in an argument of a macro.
std::string roff_escaped(const std::string& text);
std::string roff_bold(const std::string& text);
std::string roff_italic(const std::string& text);
// A text line to read: names of options, and what stands between backticks, become bold.
std::string roff_prose(const std::string& text);
// Lines that are not filled. Commands that are too wide for a page are continued in the next line, and a comment behind
// them goes in front.
std::string roff_commands(const std::vector<std::string>& commands);

}  // namespace relmap::terminal
