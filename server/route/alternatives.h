// Other routes than the cheapest, for those who want a choice (docs/method.md, 8).
//
// Searches are repeated with everything dearer on which the routes found so far lead (penalty.h), and beside it
// (beside.h), by kMaxStretch, however many of them lead there. So each part of what is found, however short, costs at
// most kMaxStretch times the cheapest way between its two ends: where it leaves the ways known before, it is the
// cheapest way around them (the bounded stretch of Abraham, Delling, Goldberg and Werneck, "Alternative routes in road
// networks", JEA 2013). Their local optimality is established afterwards: a short part that leaves the known ways only
// because these were made dearer is put back.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "proto/base/status.h"
#include "server/route/dijkstra.h"
#include "server/route/penalty.h"
#include "server/route/work_limit.h"

namespace relmap::route {

inline constexpr std::size_t kMaxAlternatives = 5;
// What an alternative may cost, relative to the cheapest route, and which share of its length may lie on or beside the
// routes before it.
inline constexpr double kMaxStretch = 1.5, kMaxShared = 0.75;
// A frame is beside a route up to this distance along edges and closures, or this share of the cheapest route's length
// if that is less.
inline constexpr double kBesideMetres = 10, kBesideShare = 0.1;
// A part that is apart from known ways and costs less than this share of the cheapest route is kept only if it is the
// cheapest way between its ends.
inline constexpr double kLocalShare = 0.25;

struct Alternative {
  Route route;
  double shared = 0;  // the share of its length that lies on or beside the routes before it, 0..kMaxShared
};

struct AlternativesQuery {
  std::span<const FrameId> from, to;
  RouteWeights weights = {};
  double max_cost = std::numeric_limits<double>::infinity();
  std::size_t count = 0;  // at most
};

// Finds the cheapest route under a penalty; Route::cost and all other figures of it are without the penalty.
using PenalisedSearch = std::function<Result<Route>(std::span<const FrameId> from, std::span<const FrameId> to,
                                                    const Penalty& penalty, const WorkLimit& work)>;

// Returns alternatives to the cheapest route, ascending by cost. None passes a frame twice. All searches together keep
// to `work`. Where that ends them, or something cannot be read, what has been found until then is returned.
// Deterministic, as `search` is.
std::vector<Alternative> find_alternatives(const storage::Graph& graph, const Route& cheapest,
                                           const AlternativesQuery& query, const PenalisedSearch& search,
                                           const WorkLimit& work);

}  // namespace relmap::route
