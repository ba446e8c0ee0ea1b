// What an edit changes, as relmap.v1 messages. Internal to server/rpc: shows generated code.
#pragma once

#include <vector>

#include "relmap/v1/map.pb.h"
#include "server/map/edge_changes.h"
#include "server/route/carried.h"

namespace relmap {

v1::EditEffect effect_message(const std::vector<EdgeChange>& changes);
v1::CarriedStretch carried_message(const CarriedStretch& stretch);

// What two edits, one after the other, changed together.
std::vector<EdgeChange> combined(std::vector<EdgeChange> first, const std::vector<EdgeChange>& second);

}  // namespace relmap
