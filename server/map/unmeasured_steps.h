// Initialises steps of a robot's motion that nothing measured (is_unmeasured()) when a closure that only binds
// landmarks leads across them. With the robot's guess, the bound landmarks would be predicted metres away from where
// they are seen, and relaxation would end in a wrong local minimum. So the step is set to agree with the closure, and
// relaxation refines it. Its prior stays the robot's guess. Steps of frozen sessions do not change.
#pragma once

#include <vector>

#include "proto/base/ids.h"
#include "storage/graph/editable_graph.h"

namespace relmap::map {

// Call when the `coming` closures have come into force, others have gone out of force, and the graph is as it will be.
// Considers each closure that is no edge of the graph and does not say that the robot was carried. If the path between
// its ends differs from its measurement by more than 0.3 m or 0.1 rad, the most uncertain guessed step on the path gets
// the transform with which the path agrees, provided that the step's prior allows it (chi-square, 99 %). A step is set
// at most once. A step with support is not set, unless `others_go`: closures went out of force, which its support may
// have come from. Appends the ends of the steps that were set to `seeds`.
void measure_steps(storage::EditableGraph& map, const std::vector<EdgeId>& coming, bool others_go,
                   std::vector<FrameId>* seeds);

// Resets guessed steps among `unused`, edges that lost their last support with a closure, to the robot's guess and its
// covariance.
void forget_steps(storage::EditableGraph& map, const std::vector<EdgeId>& unused);

}  // namespace relmap::map
