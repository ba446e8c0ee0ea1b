// One part of the relaxed map as a file for other programs. Each file says in whose frame it is, lists its tears and
// what nothing measured, and holds nothing of other parts, since how they lie to it is not known. KITTI's format alone
// has no room for words. Coordinates are those of the root's camera (x right, y down, z forward), metres.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "tools/relmap/relaxed_map.h"

namespace relmap::cli {

using FrameTimes = std::unordered_map<FrameId, std::int64_t>;  // UTC, microseconds

// What a file says of itself, a line each: part, root, sessions, tears, doubtful steps.
std::vector<std::string> description(const RelaxedMap& map, std::size_t part);
// Frames of consecutive indices, numbered from `first` on in the order of the part: "0 to 4: frames 1:0 to 1:4".
std::vector<std::string> numbering(const MapPart& part, std::size_t first);

// "time tx ty tz qx qy qz qw", seconds; session by session, in each ascending. Returns how many frames have no time:
// they are left out.
std::size_t write_tum(const RelaxedMap& map, std::size_t part, const FrameTimes& times, std::ostream& out);

// The upper three rows of the matrix, row by row; frames in the order of the part.
void write_kitti(const MapPart& part, std::ostream& out);

// VERTEX_SE3:QUAT, EDGE_SE3:QUAT, and FIX for the root. Vertices are numbered from 0; comments say which frames they
// are. Edges have the information that they were relaxed with. read_pose_graph() of tools/g2o reads it.
void write_g2o(const RelaxedMap& map, std::size_t part, std::ostream& out);

// ASCII. Vertices are frames, then `landmarks` lines of ply_landmark(), all coloured by session; edges with their kind.
void write_ply_head(const RelaxedMap& map, std::size_t part, std::uint64_t landmarks, std::ostream& out);
std::string ply_landmark(FrameId base, const SE3& T_root_base, const client::ExportedFrame::Landmark& landmark);
void write_ply_tail(const RelaxedMap& map, std::size_t part, std::ostream& out);

// Where the root lies on the Earth, and where it looks. Its y axis is taken for plumb.
struct Geodetic {
  double latitude = 0, longitude = 0;  // degrees; |latitude| <= 85
  double heading = 0;                  // of the root's z axis, degrees from north to east
  std::optional<double> altitude;      // metres above the ellipsoid; none: positions have no height
};

// RFC 7946: lines for the runs of each session, for loop closures and for steps that nothing measured, points for
// labels. GeoJSON's coordinates are longitude and latitude. Without `place` none are known, so every feature is
// unlocated
// ("geometry": null), and its property `metresInRoot` has the positions.
void write_geojson(const RelaxedMap& map, std::size_t part, const std::optional<Geodetic>& place, std::ostream& out);

}  // namespace relmap::cli
