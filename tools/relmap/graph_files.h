// Writes one part of the relaxed map as a file for other programs. Coordinates are in metres in the camera frame of the
// part's root (x right, y down, z forward). Comments in the file name the root and list the tears and the steps that
// nothing measured; only KITTI's format has no comments. A file holds one part only, since the transform between parts
// is not known.
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

// The comments of a file, one line each: part, root, sessions, tears, doubtful steps.
std::vector<std::string> description(const RelaxedMap& map, std::size_t part);
// Which numbers (lines or vertices) the frames have, counted from `first` in the order of the part; one text for each
// run of consecutive indices: "0 to 4: frames 1:0 to 1:4".
std::vector<std::string> numbering(const MapPart& part, std::size_t first);

// TUM: lines "time tx ty tz qx qy qz qw" with time in seconds, session by session, ascending within each. Frames
// without an entry in `times` are left out; returns their number.
std::size_t write_tum(const RelaxedMap& map, std::size_t part, const FrameTimes& times, std::ostream& out);

// KITTI: each line is the upper three rows of T_root_frame, row by row; frames in the order of the part.
void write_kitti(const MapPart& part, std::ostream& out);

// g2o: VERTEX_SE3:QUAT, EDGE_SE3:QUAT, and FIX for the root. Vertices are numbered from 0; comments tell their frames.
// Edges have the information matrix that they were relaxed with. read_pose_graph() of tools/g2o reads the file.
void write_g2o(const RelaxedMap& map, std::size_t part, std::ostream& out);

// PLY in ASCII: the head with the frames as vertices, then `landmarks` lines of ply_landmark(), which the caller
// writes, then the tail with the edges and their kinds. Vertices are coloured by session.
void write_ply_head(const RelaxedMap& map, std::size_t part, std::uint64_t landmarks, std::ostream& out);
std::string ply_landmark(FrameId base, const SE3& T_root_base, const client::ExportedFrame::Landmark& landmark);
void write_ply_tail(const RelaxedMap& map, std::size_t part, std::ostream& out);

// Where the root lies on the Earth, and in which direction it looks. Its y axis is assumed to point straight down.
struct Geodetic {
  double latitude = 0, longitude = 0;  // degrees; |latitude| <= 85
  double heading = 0;                  // of the root's z axis, degrees from north towards east
  std::optional<double> altitude;      // metres above the ellipsoid; nullopt: positions have no height
};

// GeoJSON (RFC 7946): lines for the runs of each session, for loop closures and for steps that nothing measured, points
// for labels. Coordinates are longitude and latitude. Without `place` they are not known: every feature is unlocated
// ("geometry": null), and its property `metresInRoot` has the positions.
void write_geojson(const RelaxedMap& map, std::size_t part, const std::optional<Geodetic>& place, std::ostream& out);

}  // namespace relmap::cli
