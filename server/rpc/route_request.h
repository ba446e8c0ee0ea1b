// What a request for a route asks for. Internal to server/rpc: shows generated code.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "relmap/v1/map.pb.h"
#include "server/map/mapper.h"
#include "server/route/dijkstra.h"
#include "server/rpc/deadline.h"

namespace relmap::rpc {

struct RouteEnds {
  std::vector<FrameId> frames;
  std::map<FrameId, v1::LocaliseReply> seen;  // those that are there because of a picture

  std::optional<v1::LocaliseReply> view_at(FrameId frame) const {
    const auto found = seen.find(frame);
    return found == seen.end() ? std::nullopt : std::optional(found->second);
  }
};

// One end with its alternatives. `what`: "from" or "to", for messages. INVALID_ARGUMENT (there is none, or too many),
// NO_SUCH_FRAME, NO_SUCH_LABEL, NO_SUCH_SESSION (a robot without frames), and what a localisation may say, of the first
// that is not there.
Result<RouteEnds> route_ends(map::Mapper& mapper, const storage::MapView& view, const v1::RouteEnd& end,
                             const google::protobuf::RepeatedPtrField<v1::RouteEnd>& others, const char* what,
                             const Deadline& deadline);

// INVALID_ARGUMENT (too many of anything, too), NO_SUCH_LABEL, NO_SUCH_SESSION, NO_SUCH_FRAME (to be avoided),
// DEADLINE.
Result<route::RouteOptions> route_options(const storage::Graph& map, const v1::FindRouteRequest& request,
                                          const Deadline& deadline);

// Of all but the ends: a stream that breaks is resumed only by a request for the same.
std::uint32_t route_fingerprint(const v1::FindRouteRequest& request);
std::uint32_t route_ends_fingerprint(const v1::FindRouteRequest& request);

}  // namespace relmap::rpc
