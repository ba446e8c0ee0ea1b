// A picture of a piece of the map: trajectories seen from above, loop closures, labels, a route, a query.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/relaxation.h"
#include "proto/geometry.h"
#include "proto/ids.h"
#include "proto/status.h"

namespace relmap {

struct MapPicture {
  struct Frame {
    FrameId id;
    SE3 T_picture_frame;  // camera frames (x right, y down, z forward): drawn with x to the right and z up
  };
  // How an edge is drawn. Loop edges in their state; those taken out are drawn only when they are given.
  enum class EdgeKind : std::uint8_t {
    kOdometry,
    kPrior,
    kLoopAccepted,
    kLoopCandidate,
    kLoopQuarantined,
    kLoopRemoved
  };
  struct Edge {
    FrameId a, b;
    EdgeKind kind = EdgeKind::kOdometry;
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
    SE3 T_picture_query;
    std::string caption;
  };

  std::string title, subtitle;
  std::vector<Frame> frames;
  std::vector<Edge> edges;  // those between frames that are not there are left out
  std::map<SessionNumber, std::string> session_names;
  std::vector<Label> labels;
  std::optional<Route> route;
  std::optional<Query> query;
  // Turn the plan so that its longer side lies across the picture; otherwise x is to the right and z up.
  bool turn_to_fit = true;
  double width = 1200;   // of the page, in points
  double png_scale = 2;  // pixels to a point
};

// Places a relaxation's components beside one another, with a gap, largest first.
std::vector<MapPicture::Frame> side_by_side(const Relaxation& relaxation);

// Writes `path`, whose ending says how: .svg or .png. EMPTY_MAP, INVALID_ARGUMENT (another ending, NaN in a pose),
// IO_ERROR.
Status write_map_picture(const MapPicture& picture, const std::string& path);

}  // namespace relmap
