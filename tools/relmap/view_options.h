// The options by which the user says what was seen, and with which camera.
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
  bool rectified = false;   // whether the pictures are rectified
};
void add_view_options(CLI::App& command, ViewOptions& options);

// Reads the pictures `left` and `right` (empty: a single picture) and finds their camera. `left` may also be a frame of
// the map ("3:120"): the view is then what that frame saw.
//
// Without an option the camera is
//   - that of a calibration in the picture's folder or the folder above, as in a data set;
//   - else that of the map's stereo sessions whose pictures have this size, if all of these have the same camera;
//   - else unknown: the daemon estimates the lens of a single picture; a pair is refused (NO_CALIBRATION).
// A single picture that is the right eye's by its name or calibration (eye_names.h) gets the right camera of the rig.
// Both choices are told on stderr.
Result<client::View> make_view(client::Client& client, terminal::Console& console, const std::string& left,
                               const std::string& right, const ViewOptions& options);

// The session that `text` names: "3", "morning#2", "cart-1/morning#2" or a uuid. NO_SUCH_SESSION; INVALID_ARGUMENT if
// several have that name; the message tells their numbers.
Result<SessionNumber> find_session(client::Client& client, terminal::Console& console, const std::string& text);

// The end of a route that `text` names: a robot ("robot:NAME"), a frame ("3:120"), a picture (the extension of a
// picture; NO_SUCH_FILE if there is no such file), else a label. "label:..." and "picture:..." force these.
Result<client::RouteEnd> make_route_end(client::Client& client, terminal::Console& console, const std::string& text,
                                        const ViewOptions& options);

// Parses "3:120". INVALID_ARGUMENT if `text` is not of that form.
Result<FrameId> parse_frame(const std::string& text);

}  // namespace relmap::cli
