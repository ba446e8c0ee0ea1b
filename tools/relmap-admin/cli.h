// The command line of the program `relmap-admin`.
#pragma once

#include <iosfwd>

#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

// Exit codes of the program.
enum ExitCode : int {
  kFine = 0,
  kFailed = 1,       // the first word on stderr is the reason
  kUsage = 2,        // wrong usage of the command line
  kDamage = 3,       // damage was found, or data were lost to it
  kOwned = 4,        // another process owns the folder and must be stopped first
  kUnreachable = 5,  // no daemon answers
  kInterrupted = 130,
};
ExitCode exit_code(const Answer& answer);

// Runs one command line and returns an ExitCode. `terminal`: whether `err` is a terminal.
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err, bool terminal);

}  // namespace relmap::admin
