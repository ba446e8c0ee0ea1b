// GET /frames/S:I/thumbnail and /frames/S:I/picture.
#pragma once

#include "tools/console/forward/daemon_link.h"
#include "tools/console/http/router.h"

namespace relmap::console {

// `link` must outlive the routes.
void add_frames(DaemonLink& link, Router& router);

}  // namespace relmap::console
