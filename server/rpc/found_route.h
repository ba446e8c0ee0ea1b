// A route that is being streamed; it is kept as long as its stream may be resumed.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/route/overlay/route_search.h"
#include "server/rpc/charge.h"
#include "storage/map/map.h"

namespace relmap::rpc {

struct FoundRoute {
  FoundRoute(storage::Budget& budget, std::uint64_t n) : number(n), charge(budget, storage::Share::kReplies) {}

  const std::uint64_t number;  // counts the routes of this run of the daemon
  std::shared_ptr<const storage::MapView> view;
  route::RouteAnswer answer;
  std::uint32_t fingerprint = 0;  // of the request without its ends
  std::uint32_t ends_fingerprint = 0;
  Charge charge;
};

}  // namespace relmap::rpc
