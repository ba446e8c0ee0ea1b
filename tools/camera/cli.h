// relmap-camera: the command line.
#pragma once

#include <iosfwd>

namespace relmap::camera {

enum ExitCode { kOk = 0, kFailed = 1, kUsage = 2, kFindings = 3, kInterrupted = 4 };

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err);

}  // namespace relmap::camera
