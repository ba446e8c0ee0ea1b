// POST /relmap.v1.SERVICE/METHOD: gRPC-Web, forwarded to the daemon as the caller.
#pragma once

#include "tools/console/forward/daemon_link.h"
#include "tools/console/http/router.h"
#include "tools/console/login.h"

namespace relmap::console {

// `link` and `login` must outlive the routes.
void add_forwarding(DaemonLink& link, Login& login, Router& router);

}  // namespace relmap::console
