// The relaxed map as files for other programs. A picture of the map, not the map: where poses cannot agree with an
// edge, there is a tear, and each file lists its tears and names the frame in whose coordinates it is.
#pragma once

#include <string>
#include <vector>

#include "tools/relmap/map_graph.h"

namespace relmap::cli {

// An edge of the graph whose ends the relaxed poses put elsewhere: more than kTearSigmas standard deviations.
struct Tear {
  client::Edge edge;
  double metres = 0, degrees = 0, sigmas = 0;
};
inline constexpr double kTearSigmas = 6;

struct RelaxedMap {
  MapGraph graph;
  Relaxation relaxation;
  std::vector<client::LabelledFrames> labels;
  std::vector<Tear> tears;  // the worst first

  // Frames in whose coordinates their components are, one each.
  std::vector<FrameId> roots() const;
};
Result<RelaxedMap> relax_map(MapGraph graph, std::vector<client::LabelledFrames> labels);

// VERTEX_SE3:QUAT, EDGE_SE3:QUAT, and FIX for each root; camera axes (x right, y down, z forward). Vertices are
// numbered from 0; comments say which frames they are. read_pose_graph() of tools/g2o reads it.
std::string to_g2o(const RelaxedMap& map);

// Where the root of the largest component lies on the Earth, and where it looks.
struct Geodetic {
  double latitude = 0, longitude = 0;  // degrees; |latitude| <= 85
  double heading = 0;                  // of the root's z axis, degrees from north to east
};

// ASCII. Vertices are frames, with session and index, coloured by session; edges with their kind; components stand side
// by side. Camera axes.
std::string to_ply(const RelaxedMap& map);

// RFC 7946: a line for each session, lines for loop closures and tears, points for labels; components stand side by
// side.
std::string to_geojson(const RelaxedMap& map, const Geodetic& root);

}  // namespace relmap::cli
