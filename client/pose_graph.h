// A connected pose graph as relaxation works on it (client/relaxation.h): frames are numbered from 0, ascending by id.
#pragma once

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

}  // namespace relmap::client
