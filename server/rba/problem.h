// A relative bundle adjustment as flat arrays by local index, without any reference to the map. The unknowns are the
// edges that have a column and the free landmarks. All other edges and landmarks are held; counted observations of
// held landmarks measure the edges only (docs/method.md, 3).
//
// Observations are grouped by landmark, and landmarks by base with the free ones first. The nodes of a base's path tree
// are consecutive, parents before children.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::rba {

inline constexpr double kPriorInverseDepth = 0.1;       // per metre: for a landmark whose depth is not measured
inline constexpr double kPriorInverseDepthSigma = 0.5;  // per metre

struct ProblemEdge {
  SE3 T_ab;
  std::int32_t column = -1;  // of its 6 x 6 blocks in the reduced system; -1: the edge does not move
  bool prior = false;
  bool prior_doubted = false;  // the prior has Huber's loss, as measurements have: others may outweigh it
  SE3 prior_T_ab;
  Matrix6 prior_information = Matrix6::Zero();
};

// A node of a base's path tree. One edge may lead to several nodes, on different paths from the base.
struct ProblemNode {
  std::int32_t parent = -1;  // index in `nodes`; -1: the root, which is the base
  std::int32_t edge = -1;
  bool forward = false;  // the path from the parent follows the edge from a to b
};

struct ProblemBase {
  std::int32_t first_node = 0, end_node = 0;  // first_node is the root
  std::int32_t first_landmark = 0, end_free = 0, end_landmark = 0;
};

struct ProblemLandmark {
  Vector3 abr = {0, 0, 0.1};
  bool depth_prior = false;
  std::int32_t first_observation = 0, end_observation = 0;
};

struct ProblemObservation {
  StereoPixel z;
  double information = 1;  // 1 / sigma^2, per px^2
  std::int32_t node = 0;   // of the observing frame in the tree of the landmark's base, index in `nodes`
  std::int32_t frame = 0;  // the observing frame, by the caller's index
  std::int32_t camera = 0;
  bool mono = false;
  bool counted = true;  // it enters the solve; otherwise only the mean error of its frame
};

struct Problem {
  std::vector<StereoCamera> cameras;
  std::vector<ProblemEdge> edges;
  std::vector<ProblemNode> nodes;
  std::vector<ProblemBase> bases;
  std::vector<ProblemLandmark> landmarks;
  std::vector<ProblemObservation> observations;
  std::int32_t columns = 0;  // number of edges that move

  // Computes T_node_base of every node from the present edges. `poses` gets one element for each node.
  void compose(std::vector<SE3>* poses) const;
};

}  // namespace relmap::rba
