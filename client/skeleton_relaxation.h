// A skeleton laid out in one frame for each connected part, for drawing, by pose-graph relaxation
// (client/relaxation.h); client/springs.h says which edges count.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "client/relaxation.h"
#include "client/skeleton.h"
#include "client/springs.h"

namespace relmap::client {

struct RelaxedSkeleton {
  struct Place {
    FrameId frame;
    SE3 T_root_frame;
  };
  // Points that edges connect, ascending, with poses relative to `root`: the chosen root, or the first point.
  struct Part {
    FrameId root;
    std::vector<Place> places;

    const SE3* find(FrameId frame) const;  // null: it is not in this part
  };

  std::vector<Part> parts;      // the one with the chosen root first, then the largest first
  std::vector<Spring> springs;  // the edges that may have counted
  bool converged = true;
};

struct SkeletonLayout {
  std::optional<FrameId> root = {};
  // A picture shows no more than this.
  RelaxationOptions relaxation = {.max_iterations = 20, .relative_tolerance = 1e-3, .loop_huber = 4};
};

// NO_SUCH_FRAME: the root is no point of the skeleton. EMPTY_MAP: it has no points. The reasons of relax().
Result<RelaxedSkeleton> relax_skeleton(const Skeleton& skeleton, const SkeletonLayout& layout = {});

}  // namespace relmap::client
