// What the log says of journal records: of sessions that begin, end and are closed, and of what an operator edits.
#pragma once

#include <string>

#include "server/map/map_builder.h"

namespace relmap::map {

// A line on a record that has been applied to `map`, with `applied` as outcome. Empty: of keyframes, gaps, refusals,
// proposals, bindings and idle work, which come by the thousand, and of edits that changed nothing.
std::string log_line(const storage::Graph& map, const storage::JournalRecord& record, const Applied& applied);

}  // namespace relmap::map
