#include "storage/maintenance/stored_events.h"

#include <algorithm>
#include <vector>

#include "storage/events/event_head.h"
#include "storage/format/keys.h"

namespace relmap::storage {
namespace {

std::string named(EventPosition last) {
  return "events up to " + std::to_string(last.sequence) + ":" + std::to_string(last.ordinal);
}

class EventCheck {
 public:
  EventCheck(std::uint64_t applied_sequence, const std::function<void(const EventDamage&)>& damaged)
      : applied_(applied_sequence), damaged_(damaged) {}

  void add_head(const Result<std::optional<EventLogHead>>& head) {
    if (head.ok())
      head_ = *head;
    else
      tell_head(Reason::DATA_LOSS, head.status().to_string());
  }

  bool add(std::string_view key, ByteSpan value) {
    const auto at = keys::events_of(key);
    if (!at) return true;
    const EventPosition last{at->sequence, at->ordinal};
    std::vector<Event> events;
    const auto header = decode_event_block(value, events);
    const auto tell = [&](Reason reason, const std::string& why) {
      damaged_({reason, std::string(key), named(last) + ": " + why});
      return true;
    };
    if (last.sequence > applied_) return tell(Reason::CORRUPT, "the map has not come so far");
    if (!first_) first_ = last;
    newest_ = last;
    if (!header.ok()) return tell(Reason::DATA_LOSS, header.status().to_string());
    bytes_through_ = std::max(bytes_through_, header->bytes_through);
    if (header->last != last) return tell(Reason::CORRUPT, "it is another block");
    if (header->before < whole_) return tell(Reason::CORRUPT, "it does not follow the block before");
    whole_ = last;
    if (!first_whole_) first_whole_ = last;
    return true;
  }

  // As the head ought to be. What it says of blocks that are lost stays, so that readers are told of the gap.
  std::optional<EventLogHead> finish() {
    if (!head_ && !first_) return std::nullopt;
    EventLogHead right = head_.value_or(EventLogHead{{}, newest_, bytes_through_});
    if (right.newest < newest_ || right.newest.sequence > applied_) right.newest = newest_;
    right.bytes_through = std::max(right.bytes_through, bytes_through_);
    right.oldest = first_whole_.value_or(right.newest);
    if (!head_)
      tell_head(Reason::DATA_LOSS, "missing");
    else if (head_->newest != right.newest || head_->bytes_through != right.bytes_through ||
             (first_ && head_->oldest != *first_ && head_->oldest != right.oldest))
      tell_head(Reason::CORRUPT, "it does not say where the log begins and ends");
    return right;
  }

 private:
  void tell_head(Reason reason, const std::string& why) {
    if (told_head_) return;
    told_head_ = true;
    damaged_({reason, std::string(keys::all_events()), "head of the log of events: " + why, true});
  }

  const std::uint64_t applied_;
  const std::function<void(const EventDamage&)>& damaged_;
  bool told_head_ = false;
  std::optional<EventLogHead> head_;
  std::optional<EventPosition> first_, first_whole_;  // the first blocks, by their keys
  EventPosition newest_, whole_;                      // the last block, and the last that is whole
  std::uint64_t bytes_through_ = 0;
};

}  // namespace

std::optional<EventLogHead> check_events(const EngineSnapshot& snapshot, std::uint64_t applied_sequence,
                                         const std::function<void(const EventDamage&)>& damaged) {
  EventCheck check(applied_sequence, damaged);
  check.add_head(load_event_head(snapshot));
  const Status scanned =
      snapshot.scan(keys::all_events(), [&](std::string_view key, ByteSpan value) { return check.add(key, value); });
  if (!scanned.ok()) damaged({Reason::DATA_LOSS, "", "log of events: " + scanned.to_string()});
  return check.finish();
}

}  // namespace relmap::storage
