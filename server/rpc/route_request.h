// Parses a request for a route. Internal to server/rpc, since it exposes generated code.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "relmap/v1/map.pb.h"
#include "server/map/mapper.h"
#include "server/route/dijkstra.h"
#include "server/rpc/deadline.h"

namespace relmap::rpc {

// How those of the ends were localised that are views.
struct SeenEnds {
  std::map<FrameId, v1::LocaliseReply> by_frame;

  // Null: the frame is not the place of a view.
  const v1::LocaliseReply* at(FrameId frame) const {
    const auto found = by_frame.find(frame);
    return found == by_frame.end() ? nullptr : &found->second;
  }
  std::size_t memory_bytes() const;
};

struct RouteEnds {
  std::vector<FrameId> frames;
  SeenEnds seen;
};

// Returns the frames of one end with its alternatives. `what` is "from" or "to", for messages. The reasons, of the
// first alternative that fails: INVALID_ARGUMENT (no end, or too many), NO_SUCH_FRAME, NO_SUCH_LABEL, NO_SUCH_SESSION
// (a robot without frames), and those of a localisation.
Result<RouteEnds> route_ends(map::Mapper& mapper, const storage::MapView& view, const v1::RouteEnd& end,
                             const google::protobuf::RepeatedPtrField<v1::RouteEnd>& others, const char* what,
                             const Deadline& deadline);

// Returns weights, filter and limits. INVALID_ARGUMENT (also for too many labels, sessions or frames), NO_SUCH_LABEL,
// NO_SUCH_SESSION, NO_SUCH_FRAME (one to be avoided), DEADLINE.
Result<route::RouteOptions> route_options(const storage::Graph& map, const v1::FindRouteRequest& request,
                                          const Deadline& deadline);

// Fingerprints of a request without its ends, and of the ends: a broken stream is resumed only by an equal request.
std::uint32_t route_fingerprint(const v1::FindRouteRequest& request);
std::uint32_t route_ends_fingerprint(const v1::FindRouteRequest& request);

}  // namespace relmap::rpc
