// Pose-graph relaxation of a piece of the relative map into one frame, for drawing.
//
// The map has no global frame, and its cycles need not close. Relaxation distributes the errors of cycles over the
// edges by their covariances, and affects only what is drawn. Tears that remain (lifts, trains) are in the picture, not
// in the map.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap::client {

enum class RelaxationEdgeKind : std::uint8_t {
  kOdometry = 0,
  kPrior = 1,  // bridges motion that was not measured
  kLoop = 2,   // has a robust cost, since closures may be wrong
};

struct RelaxationEdge {
  FrameId a, b;
  SE3 T_ab;
  Matrix6 covariance = Matrix6::Identity();  // of T_ab, for a right perturbation
  RelaxationEdgeKind kind = RelaxationEdgeKind::kOdometry;
};

struct RelaxationOptions {
  int max_iterations = 50;
  double relative_tolerance = 1e-7;  // stops when the cost falls by a smaller share (iteratively: 1e-5 at least)
  double loop_huber = 4;             // Huber's width for loop edges, in sigmas; 0: quadratic
  // The steps of a component with more frames, or with so many loops that a step would take seconds, are solved for
  // iteratively, from a start in which its cycles are closed already (client/linear_start.h), in time proportional to
  // the number of its frames and edges, but for the start, which factorises one number for each of them. Then it
  // converges slowly to the last digits, which no picture shows.
  int max_direct = 20'000;
  // Called before each iteration with the number of iterations that were done of a component. A status other than OK
  // ends the relaxation, which returns it.
  std::function<Status(int iterations)> proceed = {};
};

struct RelaxedPose {
  FrameId frame;
  SE3 T_component_frame;
  int component = 0;  // from 0; the first frame of each component has the identity, and components are not related
};

struct Relaxation {
  std::vector<RelaxedPose> poses;  // in the order of the frames given
  int components = 0;
  // The cost is the sum over edges of rho(r' S^-1 r), r = Log(T_ab^-1 T_a^-1 T_b).
  double initial_cost = 0;  // at the start
  double final_cost = 0;    // after relaxation
  int iterations = 0;       // maximum over the components, with all their frames
  bool converged = true;    // false: max_iterations were not enough
};

// What is wrong with a graph. INVALID_ARGUMENT: a frame is given twice, or an edge leads to a frame that is not given
// or to itself. NOT_FINITE, BAD_ROTATION, BAD_COVARIANCE: for an edge.
Status check_graph(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges);

// Relaxes each connected component by Levenberg-Marquardt on SE(3).
// The reasons of check_graph(); NUMERICAL: the cost is not finite. That of `proceed`.
Result<Relaxation> relax(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges,
                         const RelaxationOptions& options = {});

}  // namespace relmap::client
