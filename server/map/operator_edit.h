// Whether an edit that an operator asks for is possible now: of a frame's labels, or of a session's state.
#pragma once

#include <cstddef>
#include <string_view>

#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

inline constexpr std::size_t kMaxLabelsPerFrame = 64;

// BAD_NAME if the record sets a label that is no valid name (check_name()). The removal of such a label is valid, since
// a map may hold labels that were valid when they were set.
Status check_label(const storage::SetLabelRecord& record);

// OK if this edit is possible now. Otherwise BAD_NAME (also of a removal, if the frame has no such label),
// NO_SUCH_FRAME, SESSION_DELETED, NO_SUCH_LABEL (a removal), or BUDGET_EXCEEDED (the frame has kMaxLabelsPerFrame
// labels and this would be another). A label that the frame has already may be set again.
Status check_label_edit(const storage::Graph& graph, const storage::SetLabelRecord& record);

// The record that freezes the session or, without `frozen`, thaws it. NO_SUCH_SESSION, SESSION_DELETED;
// WRONG_STATE if it is frozen already, or is not frozen.
Result<storage::SetSessionStateRecord> freezing(const storage::Graph& graph, SessionNumber session, bool frozen);

// The session, if it can be deleted or is being deleted already. NO_SUCH_SESSION; INVALID_ARGUMENT if `uuid` is not
// that of the session, so that nobody deletes another one than was meant.
Result<storage::Session> session_to_delete(const storage::Graph& graph, SessionNumber session, std::string_view uuid);

}  // namespace relmap::map
