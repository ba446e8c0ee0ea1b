// What an edit changes, as relmap.v1 messages. Internal to server/rpc: shows generated code.
#pragma once

#include <vector>

#include "relmap/v1/map.pb.h"
#include "server/map/edge_changes.h"
#include "server/route/carried.h"

namespace relmap::rpc {

v1::EditEffect effect_message(const std::vector<map::EdgeChange>& changes);
v1::CarriedStretch carried_message(const route::CarriedStretch& stretch);

// What two edits, one after the other, changed together.
std::vector<map::EdgeChange> combined(std::vector<map::EdgeChange> first, const std::vector<map::EdgeChange>& second);

}  // namespace relmap::rpc
