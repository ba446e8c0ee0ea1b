// Log lines for journal records: for sessions that begin, end, are frozen, thawed or deleted, for an operator's edits,
// and for closures that go out of force since nothing is seen beyond them.
#pragma once

#include <string>

#include "server/map/map_builder.h"

namespace relmap::map {

// The line for a record that has been applied to `map` with the outcome `applied`. Empty for keyframes, gaps, refusals,
// proposals, bindings and idle work, which come by the thousand, and for edits that changed nothing.
std::string log_line(const storage::Graph& map, const storage::JournalRecord& record, const Applied& applied);

}  // namespace relmap::map
