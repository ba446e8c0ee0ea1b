// Pose-graph relaxation: from a piece of the relative map to one picture frame, for the eye.
//
// The map has no global frame, and its cycles need not close: this spreads what is left over the edges by their
// covariances, and only for what is drawn. Tears that remain (lifts, trains) belong to the picture, not to the map.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap::client {

enum class RelaxationEdgeKind : std::uint8_t {
  kOdometry = 0,
  kPrior = 1,  // bridges what was not seen
  kLoop = 2,   // its residual is robust, since closures may be wrong
};

struct RelaxationEdge {
  FrameId a, b;
  SE3 T_ab;
  Matrix6 covariance = Matrix6::Identity();  // of T_ab, right perturbation
  RelaxationEdgeKind kind = RelaxationEdgeKind::kOdometry;
};

struct RelaxationOptions {
  int max_iterations = 50;
  double relative_tolerance = 1e-7;  // stop when the cost falls by less
  double loop_huber = 4;             // Huber's width for loop edges, in sigmas; 0: quadratic
};

struct RelaxedPose {
  FrameId frame;
  SE3 T_component_frame;
  int component = 0;  // 0, 1, ...: each has the identity at its first frame, and no relation to the others
};

struct Relaxation {
  std::vector<RelaxedPose> poses;  // in the order of the frames given
  int components = 0;
  double initial_cost = 0;  // sum over edges of rho(r' S^-1 r), r = Log(T_ab^-1 T_a^-1 T_b): breadth-first,
  double final_cost = 0;    // and relaxed
  int iterations = 0;       // of the component that took most
  bool converged = true;    // false: max_iterations were not enough
};

// Levenberg-Marquardt on SE(3) from a breadth-first start, each connected component by itself.
// INVALID_ARGUMENT: a frame given twice, an edge to a frame that is not given or to itself. NOT_FINITE,
// BAD_ROTATION, BAD_COVARIANCE: an edge. NUMERICAL: singular although damped.
Result<Relaxation> relax(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges,
                         const RelaxationOptions& options = {});

}  // namespace relmap::client
