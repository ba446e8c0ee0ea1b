// Draws a piece of the map: trajectories seen from above, loop closures, labels, a route, a query. Parts that no edge
// connects are drawn separately, each in its own frame and at its own scale, since their relative position is not
// known.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/drawing.h"
#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap::client {

struct MapPicture {
  struct Frame {
    FrameId id;
    SE3 T_root_frame;  // between camera frames (x right, y down, z forward); drawn with x to the right and z up
    // On `scale`, 0..1; not finite: not known, drawn grey.
    double value = std::numeric_limits<double>::quiet_NaN();
  };
  // Connected frames, with poses relative to `root`.
  struct Part {
    FrameId root;
    std::vector<Frame> frames;
    std::size_t keyframes = 0;  // that the frames stand for; 0: as many as there are
  };
  // How an edge is drawn.
  enum class EdgeKind : std::uint8_t {
    kMotion,
    kUnmeasuredMotion,  // a guess of the robot's motion
    kCarriedMotion,     // the robot was carried along it
    kLoopAccepted,
    kLoopCandidate,
    kLoopQuarantined,
    kLoopRemoved
  };
  struct Edge {
    FrameId a, b;
    EdgeKind kind = EdgeKind::kMotion;
  };
  struct Label {
    FrameId frame;
    std::string text;
  };
  struct Route {
    std::vector<FrameId> frames;  // in the order travelled
    std::string caption;          // for the legend: "route to bakery, 41.2 m"
  };
  struct Query {
    FrameId frame;  // the frame in which it was localised
    SE3 T_frame_query;
    std::string caption;
  };

  // What the colours of trajectories mean, if not their sessions.
  struct Scale {
    std::string name;       // "uncertainty: standard deviation of the position"
    std::string low, high;  // what the values 0 and 1 stand for
  };
  // An edge that the poses of its ends contradict: drawn as a gap.
  struct Tear {
    FrameId a, b;
    double sigmas = 0;  // by how much, in standard deviations of the edge
  };

  std::string title, subtitle;
  std::vector<Part> parts;  // the first one gets the largest panel; beyond 24, parts are only counted
  std::vector<Edge> edges;  // edges of frames that are in no part are left out; edges between parts are only counted
  std::map<SessionNumber, std::string> session_names;
  std::vector<Label> labels;
  std::optional<Route> route;
  std::optional<Query> query;
  std::optional<Scale> scale;  // set: frames are coloured by their values instead of their sessions
  std::vector<Tear> tears;     // the worst first; the first ones are named, the others marked only
  // What the legend lists of the closures that the picture had to stretch most: "3:120/1: 7.3 sigmas".
  std::vector<std::string> strained;
  std::size_t mono_sessions = 0;  // they have no metric scale, and are only counted
  // Turns the plan so that its longer side lies across the picture; otherwise x is to the right and z up.
  bool turn_to_fit = true;
  double width = 1200;   // of the page, in points
  double png_scale = 2;  // pixels per point
  // Of a picture that does not show everything: how many keyframes the frames of a session stand for (if it is not
  // here: as many as are shown), and how many edges of a kind stand behind those that are shown.
  std::map<SessionNumber, std::size_t> session_keyframes = {};
  std::map<EdgeKind, std::size_t> alike = {};
};

inline bool is_motion(MapPicture::EdgeKind kind) { return kind <= MapPicture::EdgeKind::kCarriedMotion; }

// The picture as the bytes of a file. The reasons of write_map_picture(), but for those of its path.
Result<std::string> draw_map_picture(const MapPicture& picture, PictureFormat format);
// Writes the picture to `path`, whose ending, .svg or .png, selects the format. EMPTY_MAP (no part, or one without
// frames), INVALID_ARGUMENT (another ending, a pose that is not finite, width not in 600..4000, png_scale not in
// 0.5..4), IO_ERROR.
Status write_map_picture(const MapPicture& picture, const std::string& path);

}  // namespace relmap::client
