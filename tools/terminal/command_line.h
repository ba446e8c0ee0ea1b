// What all programs share in handling their command lines (CLI11).
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace relmap::terminal {

// Adds --version; and, hidden from --help, --manual, which prints the manual page, and --completion SHELL, which prints
// the completion for bash, zsh or fish. They are for whoever builds packages, and work whatever else is required.
void add_standard_options(CLI::App& app);

// Prints the outcome of a command line that did not parse, and returns the exit code: --help and --version go to `out`
// with 0; errors go to `err`, with the command or option that may have been meant, and return `usage`.
int end_with(const CLI::App& app, const CLI::ParseError& error, std::ostream& out, std::ostream& err, int usage);

// The names in `known` that `typed` may be a typing error of, at most three, the likeliest first: names that begin with
// it, or differ from it in few letters that are left out, added, changed or swapped.
std::vector<std::string> likely_meant(const std::string& typed, const std::vector<std::string>& known);

}  // namespace relmap::terminal
