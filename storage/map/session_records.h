// The records of sessions as a view has them: those that have been edited since the last commit in memory, all others
// in the snapshot of that commit.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/graph/graph.h"

namespace relmap::storage {

// The sessions that have been edited since the last commit, ascending by number. Immutable once it is published.
using SessionTable = std::vector<std::shared_ptr<const Session>>;

// Where the session stands, or would stand.
SessionTable::const_iterator place_of(const SessionTable& table, SessionNumber number);
// Null if the table has no such session.
std::shared_ptr<const Session> find_session(const SessionTable& table, SessionNumber number);

// The committed record of a session; nullopt if there is none. Throws StatusError (IO_ERROR, DATA_LOSS).
std::optional<Session> load_session(const EngineSnapshot& snapshot, SessionNumber number);

// As Graph::visit_sessions(), where `table` says what has changed since the snapshot. Throws StatusError (IO_ERROR,
// DATA_LOSS).
void visit_sessions(const EngineSnapshot& snapshot, const SessionTable& table, SessionNumber from,
                    const Graph::SessionVisit& visit);

}  // namespace relmap::storage
