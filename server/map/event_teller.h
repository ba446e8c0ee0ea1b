// Tells the log of events what a journal record changed, as the difference that it made to the map: a pure function of
// both, so a record that is applied again tells the same.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/events/event.h"
#include "storage/journal/journal_record.h"
#include "storage/map/map.h"

namespace relmap::map {

struct Applied;

// For one record.
class EventTeller {
 public:
  // Before the record is applied: looks at what it may change.
  EventTeller(storage::Map& map, const storage::JournalRecord& record);

  // When it is applied and published: records the events.
  void tell(std::uint64_t sequence, const storage::JournalRecord& record, const Applied& applied);

 private:
  // What events say of a session.
  struct SessionStanding {
    storage::SessionState state = storage::SessionState::kOpen;
    bool deleted = false;
    std::uint64_t skipped = 0;  // how many sequences are
    std::uint32_t frames = 0;
  };
  static SessionStanding standing(const storage::Session& session);

  void record(storage::EventContent content);
  void tell_session(const storage::JournalRecord& record);
  void tell_frame(FrameId frame);
  void tell_closures(const Applied& applied);
  void tell_closure(EdgeId id);

  storage::Map& map_;
  SessionNumber number_ = 0;               // of the record's session; 0: it has none
  std::optional<SessionStanding> before_;  // nullopt: there was no such session
  std::optional<FrameId> labelled_;        // the frame of an edit of a label
  std::vector<std::string> labels_;        // that it had
  storage::Event event_;                   // the next one, without content
};

}  // namespace relmap::map
