// The changes of an edit, as relmap.v1 messages. Internal to server/rpc, since it exposes generated code.
#pragma once

#include <vector>

#include "relmap/v1/map.pb.h"
#include "server/map/edge_changes.h"

namespace relmap::rpc {

v1::EditEffect effect_message(const std::vector<map::EdgeChange>& changes);

}  // namespace relmap::rpc
