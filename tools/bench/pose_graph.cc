#include "tools/bench/pose_graph.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace relmap::bench {

namespace {

constexpr double kUnknown = 1e-8;

SE3 pose(double x, double y, double theta) { return {so3_exp({0, -theta, 0}), {-y, 0, x}}; }

// Rows and columns of (x, y, theta) in xi.
constexpr int kRows[] = {2, 0, 4};
constexpr double kSigns[] = {1, -1, -1};

Matrix6 covariance(const double (&upper)[6]) {
  Matrix3 information;
  information << upper[0], upper[1], upper[2], upper[1], upper[3], upper[4], upper[2], upper[4], upper[5];
  const Matrix3 plane = information.inverse();
  Matrix6 result = kUnknown * Matrix6::Identity();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result(kRows[i], kRows[j]) = kSigns[i] * kSigns[j] * plane(i, j);
  return result;
}

}  // namespace

Result<PoseGraph> read_pose_graph(const std::string& path) {
  std::ifstream in(path);
  if (!in) return {Reason::NO_SUCH_FILE, path + " cannot be opened"};
  PoseGraph graph;
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto corrupt = [&](const char* what) -> Status {
      return {Reason::CORRUPT, path + ", line " + std::to_string(number) + ": " + what};
    };
    std::istringstream fields(line);
    std::string kind;
    double x = 0, y = 0, theta = 0;
    if (!(fields >> kind)) continue;
    if (kind == "VERTEX_SE2") {
      std::uint32_t id = 0;
      if (!(fields >> id >> x >> y >> theta)) return corrupt("no vertex");
      graph.vertices[id] = pose(x, y, theta);
    } else if (kind == "EDGE_SE2") {
      PoseGraph::Edge edge;
      double upper[6];
      fields >> edge.a >> edge.b >> x >> y >> theta;
      for (double& value : upper) fields >> value;
      if (!fields) return corrupt("no edge");
      if (!graph.vertices.contains(edge.a) || !graph.vertices.contains(edge.b)) return corrupt("an edge to no vertex");
      edge.T_ab = pose(x, y, theta);
      edge.covariance = covariance(upper);
      if (edge.a == edge.b)
        ++graph.self_edges;
      else
        (edge.b == edge.a + 1 ? graph.odometry : graph.loops).push_back(edge);
    } else {
      return corrupt("neither VERTEX_SE2 nor EDGE_SE2");
    }
  }
  std::sort(graph.odometry.begin(), graph.odometry.end(), [](const auto& p, const auto& q) { return p.a < q.a; });
  return graph;
}

}  // namespace relmap::bench
