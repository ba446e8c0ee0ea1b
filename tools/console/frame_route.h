// GET /frames/S:I/thumbnail and /frames/S:I/picture.
#pragma once

#include "tools/console/forward/daemon_link.h"
#include "tools/console/http/router.h"
#include "tools/console/login.h"

namespace relmap::console {

// `link` and `login` must outlive the routes.
void add_frames(DaemonLink& link, Login& login, Router& router);

}  // namespace relmap::console
