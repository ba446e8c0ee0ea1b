// The command line of the program `relmap`.
#pragma once

#include <iosfwd>

#include "proto/base/status.h"

namespace relmap::cli {

// What a run ends with.
enum ExitCode : int {
  kOk = 0,
  kNegativeAnswer = 1,  // the daemon, or this program, said no; the reason is the first word on stderr
  kUsage = 2,
  kUnreachable = 3,
  kIncomplete = 3,  // ingest: all recordings are in the map, but for keyframes that the daemon refused
  kUntrusted = 5,   // ingest: all is in the map, and some of it is not to be trusted; as relmap-frontend's
};
ExitCode exit_code(const Status& status);

// Returns an ExitCode.
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

}  // namespace relmap::cli
