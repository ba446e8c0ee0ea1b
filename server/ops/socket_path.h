// Where the daemon's Unix socket is.
#pragma once

#include <string>

#include "proto/base/status.h"

namespace relmap::ops {

// DIR/socket, as an absolute path; or, where that is longer than a socket's path may be or the disk is mounted
// read-only, a name made from it in the runtime folder: $RUNTIME_DIRECTORY or $XDG_RUNTIME_DIR, or else
// /tmp/relmap-UID, which is made with mode 0700. IO_ERROR if that folder cannot be made or is another user's.
Result<std::string> socket_path(const std::string& data_folder);

}  // namespace relmap::ops
