// Pose graphs as g2o's text files have them (Kuemmerle et al., ICRA 2011), as frames of a camera: x to the right, y
// down, z forward.
//
//   VERTEX_SE2 id x y theta           EDGE_SE2 a b dx dy dtheta, upper triangle of the information matrix
//   VERTEX_SE3:QUAT id x y z q        EDGE_SE3:QUAT a b dx dy dz q, upper triangle; q is (x, y, z, w), and the
//                                     information is of dx, dy, dz and of the vector part of q
//
// A pose in the plane is that of a robot which looks along its x, y to its left, seen from above: its plane becomes x-z
// of the camera, its x is the camera's z, its y is -x, its angle turns about -y. Lines of other kinds (FIX, PARAMS_...,
// points) are counted and left out. A file of edges only has the vertices that they name, chained by the odometry.
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
    Matrix6 covariance;  // of T_ab Exp(xi); 1e-8 where the plane knows nothing of a coordinate
  };
  // By number; frames are numbered from 0 in the order of their ids.
  std::vector<std::uint32_t> ids;
  std::vector<SE3> poses;
  std::vector<Edge> odometry;  // b == a + 1, ascending; of several between the same two, the first of the file
  std::vector<Edge> loops;     // a > b: a, the later one, recognised b; in the order of the file, of several the first
  bool planar = false;         // of SE2
  // Edges from a frame to itself say nothing and are refused: the lines on which they stand.
  std::vector<std::size_t> self_edges;
  // Further loops between two frames, of which the map keeps one: their lines.
  std::vector<std::size_t> parallel_loops;
  std::map<std::string, std::size_t> left_out;  // lines, by their first word

  const Edge* step_to(std::uint32_t frame) const;  // odometry to it from the one before; null: there is none
};

// CORRUPT, with the line: too few numbers, not finite, a rotation or an information matrix that is none, an edge to a
// vertex that is not there, neither vertices nor odometry to a frame, a vertex twice, poses in the plane and in space.
// `name` stands in messages.
Result<PoseGraph> parse_pose_graph(std::string_view text, const std::string& name, PoseAxes axes = PoseAxes::kCamera);
// Also NO_SUCH_FILE, IO_ERROR.
Result<PoseGraph> read_pose_graph(const std::string& path, PoseAxes axes = PoseAxes::kCamera);

}  // namespace relmap::g2o
