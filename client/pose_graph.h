// A connected pose graph as relaxation works on it (client/relaxation.h): frames are numbered from 0, ascending by id.
#pragma once

#include <limits>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::client {

struct PoseGraph {
  struct Link {
    int a = 0, b = 0;
    SE3 T_ab = {};
    Matrix6 covariance = Matrix6::Identity();  // of T_ab, for a right perturbation
    bool robust = false;                       // it may be wrong, and has a robust cost
  };

  int frames = 0;
  std::vector<Link> links = {};
};

// The corner of Huber's loss of a link (proto/linear/huber.h), standard deviations: `huber` if the link is robust, and
// none, which is infinity, if it is not or `huber` is 0.
inline double huber_corner(const PoseGraph::Link& link, double huber) {
  return link.robust && huber > 0 ? huber : std::numeric_limits<double>::infinity();
}

}  // namespace relmap::client
