#include "server/map/label_edit.h"

#include <algorithm>
#include <string>

#include "proto/base/names.h"
#include "server/map/closures.h"

namespace relmap::map {

Status check_label(const storage::SetLabelRecord& record) {
  return record.present ? check_name("label", record.label) : Status();
}

Status check_label_edit(const storage::Graph& graph, const storage::SetLabelRecord& record) {
  if (Status valid = check_label(record); !valid.ok()) return valid;
  const auto hot = graph.hot(record.frame);
  const std::string frame = record.frame.to_string();
  if (!hot) return {Reason::NO_SUCH_FRAME, "no frame " + frame};
  if (is_going(graph, record.frame))
    return {Reason::SESSION_DELETED, frame + " is being deleted with session " + std::to_string(record.frame.session)};
  if (std::find(hot->labels.begin(), hot->labels.end(), record.label) != hot->labels.end()) return {};
  if (!record.present) {
    if (Status named = check_name("label", record.label); !named.ok()) return named;
    return {Reason::NO_SUCH_LABEL, frame + " is not labelled '" + record.label + "'"};
  }
  if (hot->labels.size() >= kMaxLabelsPerFrame)
    return {Reason::BUDGET_EXCEEDED,
            frame + " has " + std::to_string(kMaxLabelsPerFrame) + " labels already, as many as a frame may have"};
  return {};
}

}  // namespace relmap::map
