// Relaxes a connected pose graph by Levenberg-Marquardt on SE(3).
#pragma once

#include <vector>

#include "client/pose_graph.h"
#include "client/relaxation.h"
#include "proto/base/status.h"

namespace relmap::client {

struct RelaxedGraph {
  std::vector<SE3> poses;  // T_first_frame, by frame
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;
  bool converged = true;
};

// `graph` must be connected, with covariances that are positive definite. NUMERICAL: the cost is not finite. That of
// RelaxationOptions::proceed.
Result<RelaxedGraph> relax_graph(const PoseGraph& graph, const RelaxationOptions& options);

}  // namespace relmap::client
