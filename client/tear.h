// Where a picture of the map contradicts what was measured.
#pragma once

#include <string>
#include <vector>

#include "client/springs.h"

namespace relmap::client {

// An edge that the relaxed poses contradict. From kTearSigmas standard deviations on it is called a tear.
struct Tear {
  EdgeId edge;  // as in client::Spring
  FrameId a, b;
  double metres = 0, degrees = 0, sigmas = 0;

  // "3:120/1 from 1:4 to 3:120: 0.031 m, 0.10 degrees, 7.3 sigmas"
  std::string words() const;
  std::string name() const;  // "3:120/1"; of a stretch "motion"
};
inline constexpr double kTearSigmas = 6;

// Said of a picture or an export whose relaxation ended before it converged.
inline constexpr char kNotConverged[] =
    "the layout had not converged when its iterations ended: some cycles may be open by more than their measurements "
    "say";

// By how much poses in one frame contradict a spring.
Tear strain_of(const Spring& spring, const SE3& T_root_a, const SE3& T_root_b);
void sort_worst_first(std::vector<Tear>& tears);

}  // namespace relmap::client
