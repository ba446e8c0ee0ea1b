// The views along a route, as a picture (client/route_strip.h).
#pragma once

#include <string>

#include "client/relmap_client.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

// Draws `stops` views of the route, whose steps must have covariances, into the file `out` (.png, .svg). The views are
// read from the daemon; with --json its replies are not printed. INVALID_ARGUMENT, IO_ERROR, EMPTY_MAP.
Status write_route_strip(const client::Route& route, std::size_t stops, const std::string& out, client::Client& client,
                         terminal::Console& console);

}  // namespace relmap::cli
