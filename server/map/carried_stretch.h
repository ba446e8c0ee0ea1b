// Stretches along which the robot was carried by a lift or a train, as closures in force measured them (Sibley et al.,
// 1 and 4.7; docs/method.md, 7). A closure names its stretch in Edge::carried. This file enters it with the odometry
// edges of the stretch (Edge::carried_by) and computes the transform across.
#pragma once

#include <optional>

#include "server/map/uncertain.h"
#include "server/place/map_points.h"
#include "storage/graph/editable_graph.h"

namespace relmap::map {

// The transform from the first frame of the carried stretch that contains `step` to its last, measured by the nearest
// of the closures in `step.carried_by`. The result is not an edge of the map. Nullopt if the odometry to none of these
// closures can be followed.
std::optional<storage::Edge> measured_stretch(const storage::Graph& graph, const storage::Edge& step, Drift drift);

// A function that crosses carried stretches by measured_stretch(). It computes each stretch once, however many paths
// lead over it. The graph must not change while it is in use.
place::AcrossCarried across_as_measured(const storage::Graph& graph, Drift drift);

// Lets a closure say that the robot was carried along `stretch`, and enters it there.
void say_carried(storage::EditableGraph& map, EdgeId closure, const storage::FrameRange& stretch);

// Adds `closure`, which came into force, to Edge::carried_by along its stretch, or takes it out there.
void enter_carrier(storage::EditableGraph& map, const storage::Edge& closure);
void take_out_carrier(storage::EditableGraph& map, const storage::Edge& closure);

}  // namespace relmap::map
