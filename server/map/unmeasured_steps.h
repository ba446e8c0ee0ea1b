// Steps of a robot's motion that nothing measured (is_unmeasured()), once a closure that only binds
// landmarks leads across them. Where a guess led, what the closure binds would be predicted metres away from where it
// is seen: from there a relaxation finds some minimum, and not the place. So the step begins where the closure says
// that it leads, and relaxation refines that. Priors stay what the robot guessed; steps of frozen sessions stay as they
// are.
#pragma once

#include <vector>

#include "proto/base/ids.h"
#include "storage/graph/editable_graph.h"

namespace relmap::map {

// `coming` are in force from now on, what goes for them is out of force, and the graph is what it will be. For each
// that is no edge of the graph, and does not say that the robot was carried: where the path between its ends leads more
// than 0.3 m or 0.1 rad away from where the closure measured it to, the least known of the guessed steps on it takes
// the estimate (p_a = T_ab p_b, metres) with which it leads there, if the step's prior allows it (chi-square, 99 %). A
// step is set once, and not where it is supported; unless `others_go`, whose support that may have been.
// Appends the ends of steps that were set to `seeds`, to be relaxed around.
void measure_steps(storage::EditableGraph& map, const std::vector<EdgeId>& coming, bool others_go,
                   std::vector<FrameId>* seeds);

// `unused` are edges that closures which have gone were the last to support: guessed steps are again what the robot
// guessed, and as badly known.
void forget_steps(storage::EditableGraph& map, const std::vector<EdgeId>& unused);

}  // namespace relmap::map
