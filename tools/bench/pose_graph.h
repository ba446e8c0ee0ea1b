// Pose graphs in the plane as g2o's text files have them: VERTEX_SE2 id x y theta; EDGE_SE2 a b dx dy dtheta and the
// upper triangle of the information matrix. The plane becomes x-z of a camera that looks along the robot's x: y of the
// plane, to the left, is -x; its angle, counter-clockwise seen from above, turns about -y.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "proto/geometry.h"
#include "proto/status.h"

namespace relmap::bench {

struct PoseGraph {
  struct Edge {
    std::uint32_t a = 0, b = 0;
    SE3 T_ab;
    Matrix6 covariance;  // of T_ab Exp(xi); 1e-8 where the plane knows nothing of a coordinate
  };
  std::map<std::uint32_t, SE3> vertices;
  std::vector<Edge> odometry;    // b == a + 1, ascending
  std::vector<Edge> loops;       // in the order of the file; a, the later one, recognised b
  std::uint64_t self_edges = 0;  // from a frame to itself: left out
};

// NO_SUCH_FILE; CORRUPT: a line that is none of these, an edge to a vertex that is not there.
Result<PoseGraph> read_pose_graph(const std::string& path);

}  // namespace relmap::bench
