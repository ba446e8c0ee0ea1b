// Pose graphs as g2o's text files have them (Kuemmerle et al., ICRA 2011), as frames of a camera: x to the right, y
// down, z forward.
//
//   VERTEX_SE2 id x y theta           EDGE_SE2 a b dx dy dtheta, upper triangle of the information matrix
//   VERTEX_SE3:QUAT id x y z q        EDGE_SE3:QUAT a b dx dy dz q, upper triangle; q is (x, y, z, w), and the
//                                     information is of dx, dy, dz and of the vector part of q
//
// A pose in the plane is that of a robot that looks along its x axis, with y to its left, seen from above. The plane
// becomes x-z of the camera: the robot's x is the camera's z, its y is -x, and its angle turns about -y. Lines of other
// kinds (FIX, PARAMS_..., points) are counted and left out. If a file has only edges, the poses of the vertices that
// these name are chained from the odometry.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap::g2o {

// The axes of poses in space; those in the plane are always a robot's.
enum class PoseAxes : std::uint8_t {
  kCamera,  // x right, y down, z forward
  kRobot,   // x forward, y left, z up
};

struct PoseGraph {
  struct Edge {
    std::uint32_t a = 0, b = 0;  // numbers of frames
    SE3 T_ab;
    Matrix6 covariance;  // of xi in T_ab Exp(xi); 1e-8 for coordinates that a plane does not have
  };
  // By frame number; frames are numbered from 0 in the order of their ids in the file.
  std::vector<std::uint32_t> ids;
  std::vector<SE3> poses;
  std::vector<Edge> odometry;  // b == a + 1, ascending; the first in the file of each pair
  std::vector<Edge> loops;     // a > b (a recognised b); in the order of the file, the first of each pair
  bool planar = false;         // whether the poses are SE2
  // Line numbers of edges from a frame to itself. They say nothing and are left out.
  std::vector<std::size_t> self_edges;
  // Line numbers of further loops between two frames; the map keeps one loop for each pair.
  std::vector<std::size_t> parallel_loops;
  std::map<std::string, std::size_t> left_out;  // number of lines left out, by their first word

  const Edge* step_to(std::uint32_t frame) const;  // the odometry from the previous frame; null if there is none
};

// Parses a pose graph; messages call it `name`. CORRUPT, with the line number, for: too few numbers, or numbers that
// are not finite; an invalid rotation or information matrix; an edge to a vertex that does not exist; a frame with
// neither a vertex nor odometry; a vertex given twice; poses in the plane and in space in one file.
Result<PoseGraph> parse_pose_graph(std::string_view text, const std::string& name, PoseAxes axes = PoseAxes::kCamera);
// The same for a file. Also NO_SUCH_FILE, IO_ERROR.
Result<PoseGraph> read_pose_graph(const std::string& path, PoseAxes axes = PoseAxes::kCamera);

}  // namespace relmap::g2o
