// Localises a view, for every handler that takes one. Internal to server/rpc, since it exposes generated code.
#pragma once

#include <optional>

#include "relmap/v1/map.pb.h"
#include "server/map/mapper.h"
#include "server/rpc/deadline.h"

namespace relmap::rpc {

// The reasons are those of Map.Localise.
Result<v1::LocaliseReply> localise_view(map::Mapper& mapper, const storage::MapView& view, const v1::View& shown,
                                        std::optional<FrameId> prior, const Deadline& deadline,
                                        bool correspondences = false);

}  // namespace relmap::rpc
