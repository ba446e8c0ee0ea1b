// The command line of the program `relmap`.
#pragma once

#include <iosfwd>

#include "proto/base/status.h"

namespace relmap::cli {

// Exit codes of the program.
enum ExitCode : int {
  kOk = 0,
  kNegativeAnswer = 1,  // the daemon or this program refused or failed; the first word on stderr is the reason
  kUsage = 2,
  kUnreachable = 3,
  kIncomplete = 3,  // ingest: all recordings are in the map, except for keyframes that the daemon refused
  kUntrusted = 5,   // ingest: all is in the map, but some of it cannot be trusted; the same code as relmap-frontend's
};
ExitCode exit_code(const Status& status);

// Runs one command line and returns an ExitCode.
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

}  // namespace relmap::cli
