// Notices that a robot which goes on from a place that it has recognised sees nothing of what the map shows there
// (docs/method.md, 7). Where one stretch of a town looks like another, all closures of a robot that drives through it
// agree with each other, and may all be wrong. What lies beyond the stretch tells: there the two differ.
#pragma once

#include <cstdint>
#include <optional>

#include "server/place/verify.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// By a closure in force that was made before `frame` in its session, its picture `query` should show landmarks of the
// map from about where they were seen before. Returns that it shows none of them. `recognised` is the frame whose place
// the picture shows; invalid if it shows none. Considers the last closure that leads elsewhere, and the last before it
// that leads to yet another stretch. Nullopt if something is recognised there; if the picture or the map shows too
// little to tell; if there is no such closure within 60 steps of the odometry; or if the robot stood still in between
// for so long that it may have been carried away. `seed` is that of RANSAC.
std::optional<storage::UnseenRecord> find_unseen(const storage::Graph& graph, const place::QueryPicture& query,
                                                 FrameId frame, FrameId recognised, std::uint64_t seed);

}  // namespace relmap::map
