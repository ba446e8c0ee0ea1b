// Who may look into the data folder: the user that runs the daemon, and nobody else, whatever mode it was made with.
#pragma once

#include <string>

#include "proto/base/status.h"

namespace relmap::ops {

// Takes away what others may do with the folder and what is in it, which an older version may have left open. `group`:
// its members may pass through the folder, to the socket and to what is shared with them; empty: nobody. BAD_CONFIG:
// there is no such group. IO_ERROR, as when the folder is another user's.
Status make_private(const std::string& folder, const std::string& group);

// Lets the members of the group read a file. BAD_CONFIG, IO_ERROR.
Status share_with_group(const std::string& file, const std::string& group);

}  // namespace relmap::ops
