// The command line of the program `relmap-admin`.
#pragma once

#include <iosfwd>

#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

// What a run ends with.
enum ExitCode : int {
  kFine = 0,
  kFailed = 1,       // the reason is the first word on stderr
  kUsage = 2,        // of the command line
  kDamage = 3,       // there is damage, or something was lost by it
  kOwned = 4,        // another process works on the folder, and this cannot be done beside it
  kUnreachable = 5,  // no daemon answers
  kInterrupted = 130,
};
ExitCode exit_code(const Answer& answer);

// `terminal`: of `err`. Returns an ExitCode.
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err, bool terminal);

}  // namespace relmap::admin
