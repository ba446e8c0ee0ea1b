// Where the relaxation of a large pose graph starts: rotations first, then positions (Carlone, Tron, Daniilidis and
// Dellaert, "Initialization techniques for 3D SLAM", ICRA 2015).
//
// Each of the two is a linear problem in which every axis of the world is by itself: a network of resistors, with one
// unknown for each frame instead of six. So all cycles are closed at once, however large they are, in the time that a
// few iterations of the whole problem take.
#pragma once

#include <vector>

#include "client/pose_graph.h"

namespace relmap::client {

// Of each covariance only the two traces count. Links that are robust count less the more they are off, beyond `huber`
// standard deviations (0: all count fully). Frame 0 has the identity. `graph` must be connected; `start` has rotations
// from which no link is off by half a turn, as those along a tree have.
std::vector<SE3> start_linearly(const PoseGraph& graph, const std::vector<SE3>& start, double huber);

}  // namespace relmap::client
