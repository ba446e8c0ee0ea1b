// Manual pages, written from the definitions of command lines.
#pragma once

#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace relmap::terminal {

// The section of the manual that the page of a program belongs to: 8 for what operators run, 1 for the others.
int manual_section(const std::string& program);

// The page of a program with all its commands, in roff with the macros of man(7). It does not tell the commit, so that
// it is the same wherever it is made.
std::string manual_page(const CLI::App& app);

}  // namespace relmap::terminal
