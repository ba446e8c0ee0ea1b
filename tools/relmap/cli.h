// The command line of the program `relmap`.
#pragma once

#include <iosfwd>

namespace relmap::cli {

// Returns an ExitCode (console.h).
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

}  // namespace relmap::cli
