// What the page is told of a layout, as JSON (tools/console/README.md).
#pragma once

#include <string>
#include <vector>

#include "tools/console/layout/layout_keeper.h"

namespace relmap::console {

std::string json_of(const KeeperState& state);
std::string json_of_places(const MapLayout& layout, const std::vector<FrameId>& frames);
// The frames of a request for places. INVALID_ARGUMENT.
Result<std::vector<FrameId>> frames_of_request(std::string_view request, std::size_t most);

}  // namespace relmap::console
