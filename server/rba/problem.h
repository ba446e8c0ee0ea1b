// A relative bundle adjustment as flat arrays: everything by local index, nothing of the map. What is solved for are
// the edges that have a column and the landmarks that are free; the others are held where they are, and what is counted
// of them measures the edges alone (docs/method.md, 3).
//
// Observations stand by landmark, landmarks by base, free ones first; the nodes of a base's path tree stand together,
// parents before children.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::rba {

inline constexpr double kPriorInverseDepth = 0.1;       // per metre: of a landmark whose depth nothing tells
inline constexpr double kPriorInverseDepthSigma = 0.5;  // per metre

struct ProblemEdge {
  SE3 T_ab;
  std::int32_t column = -1;  // of its 6 x 6 blocks in the reduced system; -1: it does not move
  bool prior = false;
  SE3 prior_T_ab;
  Matrix6 prior_information = Matrix6::Zero();
};

// An edge may be there more than once, on two ways from the base.
struct ProblemNode {
  std::int32_t parent = -1;  // index in `nodes`; -1: the root, which is the base
  std::int32_t edge = -1;
  bool forward = false;  // from the parent, the edge is walked a -> b
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
  std::int32_t node = 0;   // of its landmark's base's tree, index in `nodes`
  std::int32_t frame = 0;  // whose mean error it enters; the caller's index
  std::int32_t camera = 0;
  bool mono = false;
  bool counted = true;  // it enters the solve; else only the mean error of its frame
};

struct Problem {
  std::vector<StereoCamera> cameras;
  std::vector<ProblemEdge> edges;
  std::vector<ProblemNode> nodes;
  std::vector<ProblemBase> bases;
  std::vector<ProblemLandmark> landmarks;
  std::vector<ProblemObservation> observations;
  std::int32_t columns = 0;  // edges that move

  // T_node_base of every node, from the edges as they are; `poses` as long as `nodes`.
  void compose(std::vector<SE3>* poses) const;
};

}  // namespace relmap::rba
