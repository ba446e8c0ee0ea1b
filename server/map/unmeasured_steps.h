// Steps that nothing measured (storage/unmeasured.h), once a closure leads across them. Where only a guess led, what
// the closure binds would be predicted metres away from where it is seen: from there a relaxation finds some minimum,
// and not the place. So the step begins where the closure says that it leads, and relaxation refines that.
#pragma once

#include <vector>

#include "proto/ids.h"
#include "storage/editable_graph.h"

namespace relmap {

// Before closures come into force and others go: of the unmeasured steps on the path between the ends of each that
// comes, the least known one takes the estimate with which the path leads where the closure measured it to. The first
// closure across a step counts. A step that is supported by what goes counts as unmeasured.
void measure_steps(EditableGraph& map, const std::vector<EdgeId>& coming, const std::vector<EdgeId>& going);

// After closures have gone: steps between their ends that nothing supports any more are what the robot guessed again.
void forget_measured_steps(EditableGraph& map, const std::vector<EdgeId>& gone);

}  // namespace relmap
