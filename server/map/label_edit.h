// An operator's edits of labels: which labels a frame may have, and whether one can be set or removed.
#pragma once

#include <cstddef>

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

}  // namespace relmap::map
