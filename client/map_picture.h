// A picture of a piece of the map: trajectories seen from above, loop closures, labels, a route, a query. Frames that
// nothing connects are drawn apart, each part in a frame of its own, at its own scale: how they lie to each other is
// not known.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap::client {

struct MapPicture {
  struct Frame {
    FrameId id;
    SE3 T_root_frame;  // camera frames (x right, y down, z forward): drawn with x to the right and z up
  };
  // Frames that hang together, in the frame of one of them.
  struct Part {
    FrameId root;
    std::vector<Frame> frames;
  };
  // How an edge is drawn. Loop edges in their state; those taken out are drawn only when they are given.
  enum class EdgeKind : std::uint8_t {
    kMotion,
    kUnmeasuredMotion,  // of the robot, guessed
    kCarriedMotion,     // of what carried it
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
    FrameId frame;  // beside which it was taken
    SE3 T_frame_query;
    std::string caption;
  };

  std::string title, subtitle;
  std::vector<Part> parts;  // the largest picture first; of many parts the last are only counted
  std::vector<Edge> edges;  // those between frames that are not there are left out; those between parts are counted
  std::map<SessionNumber, std::string> session_names;
  std::vector<Label> labels;
  std::optional<Route> route;
  std::optional<Query> query;
  std::size_t mono_sessions = 0;  // that the map has, too: they know no metres, and are only counted
  // Turn the plan so that its longer side lies across the picture; otherwise x is to the right and z up.
  bool turn_to_fit = true;
  double width = 1200;   // of the page, in points
  double png_scale = 2;  // pixels to a point
};

inline bool is_motion(MapPicture::EdgeKind kind) { return kind <= MapPicture::EdgeKind::kCarriedMotion; }

// Writes `path`, whose ending says how: .svg or .png. EMPTY_MAP, INVALID_ARGUMENT (another ending, NaN in a pose),
// IO_ERROR.
Status write_map_picture(const MapPicture& picture, const std::string& path);

}  // namespace relmap::client
