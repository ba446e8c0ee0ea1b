// The bytes of the log of events (docs/storage-format.md, Events): blocks of events, each readable by itself, and the
// head, which says where the log begins and ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/events/event.h"

namespace relmap::storage {

// A block is closed once its events have so many bytes. A single event may have more.
inline constexpr std::size_t kEventBlockBytes = std::size_t{64} << 10;

// What events are written relative to: those before them in the block.
struct EventContext {
  EventPosition at;
  std::int64_t submitted_us = 0, frame_us = 0;
  FrameId frame;
};

// Events that are encoded and not in the log yet.
struct EventBlock {
  ByteWriter events;
  std::uint32_t count = 0;
  EventContext context;

  void add(const Event& event);  // ascending by position
  EventPosition last() const { return context.at; }
};

struct EventBlockHeader {
  std::int64_t time_us = 0;         // when it was committed, UTC
  EventPosition before;             // the last event of the log before this block; {}: there was none
  EventPosition last;               // its own last event, by which it has its key
  std::uint64_t bytes_through = 0;  // of all blocks that the log ever had, up to and including this one
};

// Sets `header.last`, and adds the block's size to `header.bytes_through`.
Bytes encode_event_block(EventBlockHeader& header, const EventBlock& block);

// Both fail with CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION. The first checks the checksum and does not decode
// events.
Result<EventBlockHeader> decode_event_block_header(ByteSpan bytes);
Result<EventBlockHeader> decode_event_block(ByteSpan bytes, std::vector<Event>& events);

struct EventLogHead {
  EventPosition oldest;             // the last event of the oldest block, by which it has its key
  EventPosition newest;             // the newest event
  std::uint64_t bytes_through = 0;  // as in the newest block's header

  bool operator==(const EventLogHead&) const = default;
};
Bytes encode_event_head(const EventLogHead& head);
Result<EventLogHead> decode_event_head(ByteSpan bytes);

}  // namespace relmap::storage
