// Searches over the cells of a map: frame by frame near the ends and where the map has changed, and by cells between,
// larger ones the further it is from the ends. dijkstra.h is the reference.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "proto/base/status.h"
#include "server/route/dijkstra.h"
#include "server/route/overlay/overlay.h"
#include "server/route/passage.h"
#include "server/route/penalty.h"
#include "server/route/work_limit.h"

namespace relmap::route {

// A step of a route: through one cell, or over one edge.
struct Hop {
  FrameId from, to;
  std::uint32_t cell = CellTree::kNone;  // kNone: the step is over `edge`
  EdgeId edge;
  bool forward = false;
  double cost = 0;
};

struct OverlayRoute {
  double cost = 0;
  std::vector<Hop> hops;  // in order; empty if the route begins where it ends
  FrameId from, to;
  std::uint64_t nodes_settled = 0;
  std::uint32_t chunks_opened = 0;
};

// A question to the overlay, and where the overlay does not hold.
struct OverlayQuery {
  std::size_t metric = 0;                   // index in overlay.metrics()
  std::span<const storage::ChunkId> stale;  // chunks with frames that changed or came since the overlay was made
  RouteFilter filter = {};                  // closures that it supposes are ignored, since cells do not contain them
  std::vector<std::uint32_t> opened;        // cells_to_open() of the filter
  double max_cost = std::numeric_limits<double>::infinity();
  Penalty penalty = {};  // the search and max_cost include it; the costs of hops do not
};

// Returns the cells that hold something that the filter refuses; a search must open them. nullopt if cells are of no
// use with this filter: if these cells are more than a tenth of the number of chunks, or if the filter supposes
// closures that are not in force. Cells can be used with a filter that supposes only closures that bind; the caller
// then searches short routes again with these closures.
std::optional<std::vector<std::uint32_t>> cells_to_open(const Overlay& overlay, const RouteFilter& filter);

// Returns the cheapest route by a metric of the overlay from any of `from` to any of `to`. `graph` is the map of which
// the overlay was made. INVALID_ARGUMENT (an end without frames), NO_SUCH_FRAME, NOT_CONNECTED (the message names the
// sessions that are joined to the start in either direction, whatever the filter), COST_LIMIT (or NOT_CONNECTED, if
// both are true), OUT_OF_REACH, and what work.proceed returns. Throws StatusError where reads of the graph or of cells
// do, or if work.proceed ends such a read.
Result<OverlayRoute> find_route(const Overlay& overlay, const storage::Graph& graph, const OverlayQuery& query,
                                std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work = {});

// Replaces each hop through a larger cell by hops through chunks and over edges. If the status is not ok, the route is
// unchanged.
Status unpack(const Overlay& overlay, const storage::Graph& graph, std::size_t metric, OverlayRoute& route,
              const WorkLimit& work = {});

// Turns an unpacked route into one of frames. `count_standing` is that of RouteOptions.
Result<Route> follow(const Overlay& overlay, const storage::Graph& graph, std::size_t metric, const OverlayRoute& route,
                     bool count_standing, const WorkLimit& work = {});

}  // namespace relmap::route
