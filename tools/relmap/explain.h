// Why a closure is in its state, as text and as a picture.
#pragma once

#include <string>

#include "client/relmap_client.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

// Prints why the edge "3:120/1" is in its state: its evidence, the closures that agree, and its history; with --json,
// the daemon's reply. `out`: the picture of its two ends to be written (.png, .svg), or empty. INVALID_ARGUMENT,
// NO_SUCH_EDGE, ODOMETRY_EDGE (a picture of the robot's own motion was asked for).
Status explain_edge(const std::string& text, const std::string& out, client::Client& client,
                    terminal::Console& console);

}  // namespace relmap::cli
