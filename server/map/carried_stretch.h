// Stretches along which the robot was carried, as closures in force measured them: a lift, a train (Sibley et al., 1
// and 4.7; docs/method.md, 7). Which they are is said by the closures (Edge::carried); here it is kept with the edges
// of the robot's own motion, and the way across is worked out.
#pragma once

#include <optional>

#include "server/map/uncertain.h"
#include "server/place/map_points.h"
#include "storage/graph/editable_graph.h"

namespace relmap::map {

// The way from the first frame of the stretch in which `step` lies to its last, measured by the nearest of the closures
// that carry it; not an edge of the map. Nullopt where none of them can be followed.
std::optional<storage::Edge> measured_stretch(const storage::Graph& graph, const storage::Edge& step, Drift drift);

// Goes across by measured_stretch(); what is met on the way is worked out once, however many ways lead over it.
place::AcrossCarried across_as_measured(const storage::Graph& graph, Drift drift);

// Enters in Edge::carried_by of the stretch that `closure` came into force, or takes it out there.
void enter_carrier(storage::EditableGraph& map, const storage::Edge& closure);
void take_out_carrier(storage::EditableGraph& map, const storage::Edge& closure);

}  // namespace relmap::map
