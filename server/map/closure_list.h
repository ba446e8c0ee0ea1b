// Lists of the edges of a whole map, and of its closures in an order, from its digests: a million frames are looked
// through in a fraction of a second.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "proto/base/status.h"
#include "server/map/edge_choice.h"
#include "storage/map/map.h"

namespace relmap::map {

enum class ClosureOrder : std::uint8_t {
  kSuspicion,  // the most suspicious first, then by id
  kTime,       // the newest first, by the time of the newer end, then by descending id
};

// A closure, and what it is ordered by. The order of a version of the map is total, and the same whenever it is asked
// for, so a list goes on behind any closure of it.
struct ListedClosure {
  EdgeId id;
  double suspicion = 0;
  std::int64_t time_us = 0;  // of its newer end
};

using Proceed = std::function<Status()>;  // asked now and then; a status that is not ok ends the work

// Returns the first loop closures in this order, behind `after` if that is given, at most `count`: as many as there are
// if they are fewer. Memory: 32 bytes each. DATA_LOSS, IO_ERROR, VIEW_EXPIRED, and what `proceed` returns. Thread-safe.
Result<std::vector<ListedClosure>> first_closures(const storage::MapView& map, const EdgeChoice& choice,
                                                  ClosureOrder order, const std::optional<ListedClosure>& after,
                                                  std::size_t count, const Proceed& proceed);

// Visits the edges behind `after` (invalid: from the first on) that the choice has, by id, until `visit` returns false.
// Only frames that have such an edge, or may have, are read; with a region, no digests. Reasons as above.
Status visit_edges(const storage::MapView& map, const EdgeChoice& choice, EdgeId after, const Proceed& proceed,
                   const std::function<bool(const storage::Edge&, std::int64_t time_us)>& visit);

// The loop closures between two sessions, or within one.
struct ClosureCell {
  SessionNumber session_a = 0, session_b = 0;  // session_a <= session_b
  std::uint32_t candidate = 0, accepted = 0, quarantined = 0, removed = 0;
  EdgeId most_suspicious = {};  // of those in force; invalid: none is
  double suspicion = 0;         // of it
};

// Returns the first cells behind the pair `after`, ascending by session_a and session_b, at most `count`; of pairs
// without closures there are none. `sessions`: only pairs with one of these, ascending; empty: all. Memory: 100 bytes a
// cell. Reasons as above.
Result<std::vector<ClosureCell>> closure_cells(const storage::MapView& map, std::span<const SessionNumber> sessions,
                                               std::pair<SessionNumber, SessionNumber> after, std::size_t count,
                                               const Proceed& proceed);

}  // namespace relmap::map
