// What all programs do alike with their command lines (CLI11).
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace relmap::terminal {

// Adds --version.
void add_version(CLI::App& app);

// Ends a program whose command line was not to be run: --help and --version go to `out`, and 0 is returned; what is
// wrong goes to `err`, with the command or option that may have been meant, and `usage` is returned.
int end_with(const CLI::App& app, const CLI::ParseError& error, std::ostream& out, std::ostream& err, int usage);

// Those of `known` that `typed` may be a slip of, the likeliest first, three at most: with few letters left out, added,
// changed or exchanged, or begun so.
std::vector<std::string> likely_meant(const std::string& typed, const std::vector<std::string>& known);

}  // namespace relmap::terminal
