#include "server/map/record_log.h"

#include <algorithm>

namespace relmap::map {

namespace {

std::string name_of(const storage::Session& session) {
  return "session " + std::to_string(session.number) + " '" + session.display_name + "' of robot " +
         session.header.robot;
}

std::string quoted_note(const std::string& note) { return note.empty() ? "" : ": " + note; }

const char* word_for(storage::EdgeState state) {
  switch (state) {
    case storage::EdgeState::kCandidate:
      return "a candidate";
    case storage::EdgeState::kAccepted:
      return "in force";
    case storage::EdgeState::kQuarantined:
      return "quarantined";
    case storage::EdgeState::kRemoved:
      return "removed";
  }
  return "";
}

std::string line(const storage::Graph& map, const storage::SessionRecord& record, const Applied&) {
  const auto session = map.session(record.number);
  return session && session->frames == 0 ? name_of(*session) + " begins" : "";
}

std::string line(const storage::Graph& map, const storage::SetSessionStateRecord& record, const Applied&) {
  const auto session = map.session(record.session);
  if (!session) return "";
  const std::string frames = ", " + std::to_string(session->frames) + " frames";
  switch (record.state) {
    case storage::SessionState::kOpen:  // a frozen one is thawed
      return storage::is_going(*session)
                 ? ""
                 : name_of(*session) + " is thawed, and " +
                       (session->state == storage::SessionState::kEnded ? "ended" : "open") + " as it was";
    case storage::SessionState::kEnded:
      return session->state == storage::SessionState::kEnded ? name_of(*session) + " has ended" + frames : "";
    case storage::SessionState::kFrozen:
      return storage::is_frozen(*session) ? name_of(*session) + " is frozen" + frames : "";
    case storage::SessionState::kDeleting:
      return name_of(*session) + " is being deleted" + frames;
  }
  return "";
}

std::string line(const storage::Graph&, const storage::SetEdgeStateRecord& record, const Applied& applied) {
  std::size_t others = 0;
  const EdgeChange* named = nullptr;
  for (const EdgeChange& change : applied.edges) {
    if (change.id == record.edge)
      named = &change;
    else if (change.before && change.after && change.before->state != change.after->state)
      ++others;
  }
  if (!named || !named->before || !named->after) return "";
  return "operator: closure " + record.edge.to_string() + " was " + word_for(named->before->state) + " and is " +
         word_for(named->after->state) + " (" + std::string(reason_name(named->after->reason)) + ")" +
         (others > 0 ? ", with " + std::to_string(others) + " others" : "") + quoted_note(record.note);
}

std::string line(const storage::Graph&, const storage::UnseenRecord& record, const Applied& applied) {
  const auto gone = std::ranges::count_if(applied.edges, [](const EdgeChange& change) {
    return change.after && change.after->reason == Reason::NOT_SEEN_BEYOND;
  });
  if (gone == 0) return "";
  return "closure " + record.closure.to_string() +
         (gone > 1 ? " and " + std::to_string(gone - 1) + " that agree with it are" : " is") +
         " quarantined: going on from there, the robot saw nothing of what the map shows, last in frame " +
         record.frame.to_string();
}

std::string line(const storage::Graph& map, const storage::SetLabelRecord& record, const Applied&) {
  if (!map.hot(record.frame)) return "";
  return "operator: frame " + record.frame.to_string() +
         (record.present ? " is labelled '" : " is no longer labelled '") + record.label + "'";
}

template <typename Record>
std::string line(const storage::Graph&, const Record&, const Applied&) {
  return "";
}

}  // namespace

std::string log_line(const storage::Graph& map, const storage::JournalRecord& record, const Applied& applied) {
  return std::visit([&](const auto& r) { return line(map, r, applied); }, record);
}

}  // namespace relmap::map
