// Keeps what is derived from the accepted graph in step with it: observers, path support of edges, priors (METHOD 2).
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "storage/map.h"

namespace relmap {

// All observations of frame `id` have just been added: adds it to its landmarks' observers and its paths to the support
// of the edges on them.
void add_support(Map& map, FrameId id);

// Recomputes observers and support around these frames (everything within D of them), after the graph or the bindings
// there have changed by `change`, which is called between taking the old contributions out and putting the new ones in.
void change_support(Map& map, std::span<const FrameId> around, const std::function<void()>& change);

}  // namespace relmap
