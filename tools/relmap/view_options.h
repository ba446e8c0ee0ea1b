// How the user says what was seen, and by which camera.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "client/relmap_client.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

struct ViewOptions {
  std::string calibration;  // file or folder
  std::string session;      // number or name
  bool rectified = false;   // the pictures are
};
void add_view_options(CLI::App& command, ViewOptions& options);

// Without an option the camera is that of a calibration which lies in the picture's folder or the one above it, as in a
// data set; else that of the map's stereo sessions whose camera takes pictures of this size, when they have the same
// one; which it is is told on stderr. Else there is none, and the lens is estimated; a pair is NO_CALIBRATION then, and
// the message names the options. One picture whose name or calibration says that it is the right eye's (eye_names.h) is
// of that eye by itself, which is told on stderr, too. `left` may be a frame ("3:120"): what that frame of the map saw.
Result<client::View> make_view(client::Client& client, terminal::Console& console, const std::string& left,
                               const std::string& right, const ViewOptions& options);

// "3", "morning#2", "cart-1/morning#2" or a uuid. NO_SUCH_SESSION; INVALID_ARGUMENT: several are called so, with their
// numbers.
Result<SessionNumber> find_session(client::Client& client, terminal::Console& console, const std::string& text);

// A frame ("3:120"), else a picture (a file that exists and ends like one), else a label. "label:..." and "picture:..."
// say which it is.
Result<client::RouteEnd> make_route_end(client::Client& client, terminal::Console& console, const std::string& text,
                                        const ViewOptions& options);

// INVALID_ARGUMENT
Result<FrameId> parse_frame(const std::string& text);

}  // namespace relmap::cli
