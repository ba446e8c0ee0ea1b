#include "server/map/operator_edit.h"

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

Result<storage::SetSessionStateRecord> freezing(const storage::Graph& graph, SessionNumber session, bool frozen) {
  const auto found = storage::existing_session(graph, session);
  if (!found.ok()) return found.status();
  if (storage::is_going(*found))
    return {Reason::SESSION_DELETED, "session " + found->display_name + " is being deleted"};
  if (storage::is_frozen(*found) == frozen)
    return {Reason::WRONG_STATE, "session " + found->display_name + (frozen ? " is frozen already" : " is not frozen")};
  return storage::SetSessionStateRecord{session,
                                        frozen ? storage::SessionState::kFrozen : storage::SessionState::kOpen};
}

Result<storage::Session> session_to_delete(const storage::Graph& graph, SessionNumber session, std::string_view uuid) {
  const auto found = storage::existing_session(graph, session);
  if (!found.ok()) return found.status();
  if (uuid != found->header.uuid.to_string())
    return {Reason::INVALID_ARGUMENT, "session " + found->display_name + " has another uuid than '" +
                                          std::string(uuid) + "': was another one meant?"};
  return found;
}

}  // namespace relmap::map
