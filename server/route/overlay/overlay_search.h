// Searches over the cells of a map: frame by frame at the ends and where the map has changed, cells, the larger the
// further, between. dijkstra.h is the reference.
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
#include "server/route/work_limit.h"

namespace relmap::route {

// The way through one cell of the map, or over one edge.
struct Hop {
  FrameId from, to;
  std::uint32_t cell = CellTree::kNone;  // none: over `link`
  EdgeId edge;
  bool forward = false;
  double cost = 0;
};

struct OverlayRoute {
  double cost = 0;
  std::vector<Hop> hops;  // one after the other; none: it begins where it ends
  FrameId from, to;
  std::uint64_t nodes_settled = 0;
  std::uint32_t chunks_opened = 0;
};

// What is asked for, and what the cells do not know.
struct OverlayQuery {
  std::size_t metric = 0;                   // which of overlay.metrics()
  std::span<const storage::ChunkId> stale;  // frames of these changed, or came, since the overlay was made
  RouteFilter filter = {};                  // the closures that it supposes are left out: cells do not know them
  std::vector<std::uint32_t> opened;        // cells_to_open() of the filter
  double max_cost = std::numeric_limits<double>::infinity();
};

// Cells that hold what the filter refuses: a search looks into them. Nullopt, as cells are of no use then: they are
// more than a tenth as many as there are chunks, or the filter supposes closures that are not in force. A filter that
// supposes only closures that bind has its cells: the caller searches short routes once more, with these closures.
std::optional<std::vector<std::uint32_t>> cells_to_open(const Overlay& overlay, const RouteFilter& filter);

// The cheapest route by a metric of the overlay from any of `from` to any of `to`. `graph`: the map that the overlay is
// of. INVALID_ARGUMENT (an end without frames), NO_SUCH_FRAME, NOT_CONNECTED (the message names the sessions that are
// joined to the start in either direction, whatever the filter), COST_LIMIT (or NOT_CONNECTED, where both are true),
// OUT_OF_REACH, and what work.proceed says. Throws StatusError where reads of the graph or of cells do, and what
// work.proceed says meanwhile.
Result<OverlayRoute> find_route(const Overlay& overlay, const storage::Graph& graph, const OverlayQuery& query,
                                std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work = {});

// The same way with no cell in it that is larger than a chunk. Not ok: the route is as it was.
Status unpack(const Overlay& overlay, const storage::Graph& graph, std::size_t metric, OverlayRoute& route,
              const WorkLimit& work = {});

// Frame by frame, of an unpacked route. `count_standing`: as RouteOptions have it.
Result<Route> follow(const Overlay& overlay, const storage::Graph& graph, std::size_t metric, const OverlayRoute& route,
                     bool count_standing, const WorkLimit& work = {});

}  // namespace relmap::route
