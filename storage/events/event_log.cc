#include "storage/events/event_log.h"

#include <optional>
#include <utility>

#include "storage/events/event_block.h"
#include "storage/events/event_head.h"
#include "storage/format/keys.h"

namespace relmap::storage {
namespace {

Status lost(const Status& why) {
  if (why.reason() == Reason::IO_ERROR) return why;
  return {Reason::DATA_LOSS, "head of the log of events: " + why.to_string()};
}

class Reading {
 public:
  Reading(EventPosition after, std::size_t max_bytes) : after_(after), max_bytes_(max_bytes) { read_.through = after; }

  // Takes what the block tells. False: what was read is enough.
  bool add(std::string_view key, ByteSpan value) {
    const auto at = keys::events_of(key);
    if (!at) return true;
    const EventPosition last{at->sequence, at->ordinal};
    std::vector<Event> events;
    const auto header = decode_event_block(value, events);
    const bool damaged = !header.ok() || header->last != last;
    // The position {} is before all events, whatever the log no longer has.
    const bool gap = read_.through != EventPosition() && (damaged || read_.through < header->before);
    if (gap && !read_.events.empty()) {  // what is before the gap is told first
      more_ = true;
      return false;
    }
    read_.gap = read_.gap || gap;
    read_.through = last;
    if (damaged) return true;
    for (Event& event : events) {
      if (event.at <= after_) continue;
      event.committed_us = header->time_us;
      read_.events.push_back(std::move(event));
    }
    bytes_ += value.size();
    return bytes_ < max_bytes_;
  }

  EventsRead finish(EventPosition newest) && {
    if (read_.through < newest && !more_ && bytes_ < max_bytes_) {  // blocks that ought to be there are not
      if (read_.events.empty()) {
        read_.gap = after_ != EventPosition();
        read_.through = newest;
      }
    }
    read_.more = read_.through < newest;
    return std::move(read_);
  }

 private:
  const EventPosition after_;
  const std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  bool more_ = false;
  EventsRead read_;
};

}  // namespace

Result<EventsRead> read_events(const EngineSnapshot& snapshot, EventPosition after, std::size_t max_bytes) {
  const auto head = load_event_head(snapshot);
  if (!head.ok()) return lost(head.status());
  Reading reading(after, max_bytes);
  if (!*head || after >= (*head)->newest) return std::move(reading).finish(after);
  const EventPosition oldest = (*head)->oldest;
  // The first block whose last event is behind `after`. Where that is no longer there, the oldest: a scan from `after`
  // on would cross all that was deleted since.
  const std::string from = after < oldest ? keys::events(oldest.sequence, oldest.ordinal)
                                          : keys::events(after.sequence, after.ordinal) + '\0';
  const Status scanned = snapshot.scan_from(
      keys::all_events(), from, [&](std::string_view key, ByteSpan value) { return reading.add(key, value); });
  if (!scanned.ok()) return scanned;
  return std::move(reading).finish((*head)->newest);
}

Result<EventPosition> newest_event(const EngineSnapshot& snapshot) {
  const auto head = load_event_head(snapshot);
  if (!head.ok()) return lost(head.status());
  return *head ? (*head)->newest : EventPosition();
}

}  // namespace relmap::storage
