// Computes the transform between two frames along the map's path between them.
#pragma once

#include "server/route/stretches.h"
#include "server/route/work_limit.h"
#include "storage/graph/graph.h"

namespace relmap::route {

struct Transform {
  SE3 T_ab;                              // p_a = T_ab p_b
  Matrix6 covariance = Matrix6::Zero();  // of T_ab Exp(xi)
  bool compounded = false;         // whether `covariance` is compounded from marginals and what odometry edges share
  std::uint32_t edges = 0;         // on the path
  double distance_m = 0;           // along the path
  CarriedStretches carried;        // on the path, from a to b
  UnmeasuredStretches unmeasured;  // on the path, from a to b; with any, T_ab is a guess
};

// Returns T_ab along the path that breadth-first search from `a` finds, of any length. NO_SUCH_FRAME, NOT_CONNECTED,
// OUT_OF_REACH, and what work.proceed returns. Throws StatusError where reads of the graph do.
Result<Transform> transform_between(const storage::Graph& graph, FrameId a, FrameId b, const WorkLimit& work = {});

}  // namespace relmap::route
