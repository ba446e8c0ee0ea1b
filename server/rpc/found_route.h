// A route that is being streamed: kept for as long as its stream may be resumed.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/route/dijkstra.h"
#include "server/rpc/charge.h"
#include "storage/map.h"

namespace relmap {

struct FoundRoute {
  FoundRoute(Budget& budget, std::uint64_t n) : number(n), charge(budget, Share::kReplies) {}

  const std::uint64_t number;  // of this run of the daemon
  std::shared_ptr<const MapView> view;
  Route route;
  bool near = false;              // found around the start, with closures that only bind
  bool no_way_by_edges = false;   // and edges alone do not lead there
  std::string frame_by_frame;     // why it was searched so; empty: by cells
  std::uint32_t fingerprint = 0;  // of the request, its ends apart
  std::uint32_t ends_fingerprint = 0;
  Charge charge;
};

}  // namespace relmap
