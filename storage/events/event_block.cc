#include "storage/events/event_block.h"

#include <type_traits>
#include <utility>

#include "storage/format/sealed.h"
#include "storage/format/varint.h"

namespace relmap::storage {
namespace {

using varint::get_signed;
using varint::get_unsigned;
using varint::put_signed;
using varint::put_unsigned;

constexpr std::uint8_t kHeadKind = 6, kBlockKind = 7;  // after those of state_codec.cc
constexpr std::uint16_t kEventsVersion = 1;

// The first byte of an event: its kind, which is its place in EventContent and never changes, and what follows.
constexpr std::uint8_t kKindBits = 0x0f, kHasTime = 0x10, kHasAuthor = 0x20, kHasNote = 0x40, kNextOrdinal = 0x80;
constexpr std::uint8_t kHasTransform = 0x80;  // beside the source of a frame's motion

std::uint32_t get_small(ByteReader& r) { return static_cast<std::uint32_t>(get_unsigned(r)); }

// Differences that wrap where the numbers are not plausible.
void put_difference(ByteWriter& w, std::int64_t value, std::int64_t& before) {
  put_signed(w, static_cast<std::int64_t>(static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(before)));
  before = value;
}
std::int64_t get_difference(ByteReader& r, std::int64_t& before) {
  before = static_cast<std::int64_t>(static_cast<std::uint64_t>(before) + static_cast<std::uint64_t>(get_signed(r)));
  return before;
}

// All further reads fail.
void fail_reads(ByteReader& r) { (void)r.get_bytes(r.remaining() + 1); }

void put_text(ByteWriter& w, const std::string& text) {
  put_unsigned(w, text.size());
  w.put_bytes(as_bytes(text));
}
std::string get_text(ByteReader& r) {
  const auto bytes = r.get_bytes(varint::get_count(r));
  return {bytes.begin(), bytes.end()};
}

template <typename Enum>
Enum get_enum(ByteReader& r, Enum last) {
  const auto value = r.get<Enum>();
  if (value > last) fail_reads(r);
  return value;
}
Reason get_reason(ByteReader& r) {
  const std::uint64_t value = get_unsigned(r);
  if (value > 0xffff || !is_reason(static_cast<std::uint16_t>(value))) fail_reads(r);
  return static_cast<Reason>(value);
}

void put_position(ByteWriter& w, EventPosition at) {
  put_unsigned(w, at.sequence);
  put_unsigned(w, at.ordinal);
}
EventPosition get_position(ByteReader& r) {
  EventPosition at;
  at.sequence = get_unsigned(r);
  at.ordinal = get_small(r);
  return at;
}

// Identities are written relative to the frame before, which `c` remembers.
void put_frame(ByteWriter& w, EventContext& c, FrameId id) {
  varint::put(w, id, c.frame);
  c.frame = id;
}
FrameId get_frame(ByteReader& r, EventContext& c) { return c.frame = varint::get_frame(r, c.frame); }
void put_edge(ByteWriter& w, EventContext& c, EdgeId id) {
  varint::put(w, id, c.frame);
  c.frame = id.frame;
}
EdgeId get_edge(ByteReader& r, EventContext& c) {
  const EdgeId id = varint::get_edge(r, c.frame);
  c.frame = id.frame;
  return id;
}

void put(ByteWriter& w, EventContext&, const SessionEvent& x) {
  put_unsigned(w, x.session);
  w.put_array(x.uuid.bytes.data(), x.uuid.bytes.size());
  put_text(w, x.robot);
  put_text(w, x.display_name);
  w.put(x.state);
}
void get(ByteReader& r, EventContext&, SessionEvent& x) {
  x.session = get_small(r);
  r.get_array(x.uuid.bytes.data(), x.uuid.bytes.size());
  x.robot = get_text(r);
  x.display_name = get_text(r);
  x.state = get_enum(r, SessionState::kDeleting);
}

void put(ByteWriter& w, EventContext& c, const FrameAddedEvent& x) {
  put_frame(w, c, x.frame);
  put_difference(w, x.time_us, c.frame_us);
  w.put(static_cast<std::uint8_t>(static_cast<std::uint8_t>(x.source) | (x.T_previous_frame ? kHasTransform : 0)));
  if (x.T_previous_frame) varint::put(w, *x.T_previous_frame);
}
void get(ByteReader& r, EventContext& c, FrameAddedEvent& x) {
  x.frame = get_frame(r, c);
  x.time_us = get_difference(r, c.frame_us);
  const auto byte = r.get<std::uint8_t>();
  x.source = static_cast<MotionSource>(byte & ~kHasTransform);
  if (static_cast<int>(x.source) >= kMotionSources) fail_reads(r);
  if ((byte & kHasTransform) != 0) x.T_previous_frame = varint::get_se3(r);
}

void put(ByteWriter& w, EventContext&, const SkippedEvent& x) {
  put_unsigned(w, x.session);
  put_unsigned(w, x.skipped.from);
  put_unsigned(w, x.skipped.to);
  w.put(x.skipped.crc);
  w.put(static_cast<std::uint8_t>(x.skipped.refused));
  put_unsigned(w, static_cast<std::uint64_t>(x.skipped.reason));
}
void get(ByteReader& r, EventContext&, SkippedEvent& x) {
  x.session = get_small(r);
  x.skipped.from = get_small(r);
  x.skipped.to = get_small(r);
  x.skipped.crc = r.get<std::uint32_t>();
  x.skipped.refused = r.get<std::uint8_t>() != 0;
  x.skipped.reason = get_reason(r);
}

void put(ByteWriter& w, EventContext&, const FramesRemovedEvent& x) {
  put_unsigned(w, x.session);
  put_unsigned(w, x.first);
}
void get(ByteReader& r, EventContext&, FramesRemovedEvent& x) {
  x.session = get_small(r);
  x.first = get_small(r);
}

void put(ByteWriter& w, EventContext&, const SessionDeletedEvent& x) {
  put_unsigned(w, x.session);
  w.put_array(x.uuid.bytes.data(), x.uuid.bytes.size());
}
void get(ByteReader& r, EventContext&, SessionDeletedEvent& x) {
  x.session = get_small(r);
  r.get_array(x.uuid.bytes.data(), x.uuid.bytes.size());
}

void put(ByteWriter& w, EventContext& c, const ClosureEvent& x) {
  put_edge(w, c, x.id);
  varint::put(w, x.a, x.id.frame);
  w.put(static_cast<std::uint8_t>(static_cast<std::uint8_t>(x.kind) | (static_cast<std::uint8_t>(x.state) << 4)));
  w.put(static_cast<std::uint8_t>(static_cast<std::uint8_t>(x.verification) | (x.carries ? 0x80 : 0)));
  put_unsigned(w, static_cast<std::uint64_t>(x.reason));
  varint::put(w, x.T_ab);
  put_unsigned(w, x.inliers);
  w.put(x.probability);
  w.put(x.spread);
}
void get(ByteReader& r, EventContext& c, ClosureEvent& x) {
  x.id = get_edge(r, c);
  x.a = varint::get_frame(r, x.id.frame);
  const auto kind = r.get<std::uint8_t>(), how = r.get<std::uint8_t>();
  x.kind = static_cast<EdgeKind>(kind & 15);
  x.state = static_cast<EdgeState>(kind >> 4);
  x.verification = static_cast<Verification>(how & 0x7f);
  x.carries = (how & 0x80) != 0;
  x.reason = get_reason(r);
  x.T_ab = varint::get_se3(r);
  x.inliers = static_cast<std::uint16_t>(get_unsigned(r));
  x.probability = r.get<float>();
  x.spread = r.get<float>();
  if (x.kind < EdgeKind::kOdometry || x.kind > EdgeKind::kPrior || x.state < EdgeState::kCandidate ||
      x.state > EdgeState::kRemoved || x.verification > Verification::kCompounded)
    fail_reads(r);
}

void put(ByteWriter& w, EventContext& c, const ClosureRemovedEvent& x) { put_edge(w, c, x.id); }
void get(ByteReader& r, EventContext& c, ClosureRemovedEvent& x) { x.id = get_edge(r, c); }

void put(ByteWriter& w, EventContext& c, const LabelsEvent& x) {
  put_frame(w, c, x.frame);
  put_unsigned(w, x.labels.size());
  for (const std::string& label : x.labels) put_text(w, label);
}
void get(ByteReader& r, EventContext& c, LabelsEvent& x) {
  x.frame = get_frame(r, c);
  for (std::size_t n = varint::get_count(r); n > 0 && r.ok(); --n) x.labels.push_back(get_text(r));
}

void put(ByteWriter& w, EventContext& c, const FramesMovedEvent& x) {
  put_unsigned(w, x.ranges.size());
  for (const FrameRange& range : x.ranges) {
    put_frame(w, c, {range.session, range.first});
    put_unsigned(w, range.last - range.first);
    c.frame.index = range.last;
  }
}
void get(ByteReader& r, EventContext& c, FramesMovedEvent& x) {
  for (std::size_t n = varint::get_count(r); n > 0 && r.ok(); --n) {
    const FrameId first = get_frame(r, c);
    const std::uint64_t length = get_unsigned(r);
    if (length > ~first.index) fail_reads(r);
    c.frame.index = static_cast<std::uint32_t>(first.index + length);
    x.ranges.push_back({first.session, first.index, c.frame.index});
  }
}

// Reads an event's content of the kind that stands at place `kind` of the variant; false if there is none.
template <std::size_t kPlace = 0>
bool get_content(ByteReader& r, EventContext& c, std::size_t kind, EventContent& content) {
  if constexpr (kPlace < std::variant_size_v<EventContent>) {
    if (kind != kPlace) return get_content<kPlace + 1>(r, c, kind, content);
    get(r, c, content.template emplace<kPlace>());
    return r.ok();
  }
  return false;
}

bool get_event(ByteReader& r, EventContext& c, Event& event) {
  const auto byte = r.get<std::uint8_t>();
  const EventPosition before = c.at;
  if ((byte & kNextOrdinal) != 0) {
    ++c.at.ordinal;
  } else {
    c.at.sequence += get_unsigned(r);
    c.at.ordinal = get_small(r);
  }
  event.at = c.at;
  if ((byte & kHasTime) != 0) event.submitted.time_us = get_difference(r, c.submitted_us);
  if ((byte & kHasAuthor) != 0) event.submitted.author = get_text(r);
  if ((byte & kHasNote) != 0) event.note = get_text(r);
  return c.at > before && get_content(r, c, byte & kKindBits, event.content);
}

Status not_whole(const char* what) { return {Reason::CORRUPT, std::string("malformed ") + what}; }

// The header of a block, with the rest of its body in `r`.
Result<EventBlockHeader> open_block(ByteSpan bytes, ByteReader& r) {
  const auto sealed = unseal(bytes, kEventsVersion, kEventsVersion);
  if (!sealed.ok()) return sealed.status();
  if (sealed->kind != kBlockKind) return not_whole("block of events");
  r = ByteReader(sealed->body);
  EventBlockHeader header;
  header.time_us = r.get<std::int64_t>();
  header.bytes_through = r.get<std::uint64_t>();
  header.before = get_position(r);
  header.last = get_position(r);
  if (!r.ok() || header.last <= header.before) return not_whole("block of events");
  return header;
}

}  // namespace

void EventBlock::add(const Event& event) {
  const bool next = event.at.sequence == context.at.sequence && event.at.ordinal == context.at.ordinal + 1 && count > 0;
  const bool timed = event.submitted.time_us != 0, authored = !event.submitted.author.empty();
  events.put(static_cast<std::uint8_t>(event.content.index() | (timed ? kHasTime : 0) | (authored ? kHasAuthor : 0) |
                                       (event.note.empty() ? 0 : kHasNote) | (next ? kNextOrdinal : 0)));
  if (!next) {
    put_unsigned(events, event.at.sequence - context.at.sequence);
    put_unsigned(events, event.at.ordinal);
  }
  context.at = event.at;
  if (timed) put_difference(events, event.submitted.time_us, context.submitted_us);
  if (authored) put_text(events, event.submitted.author);
  if (!event.note.empty()) put_text(events, event.note);
  std::visit([this](const auto& content) { put(events, context, content); }, event.content);
  ++count;
}

Bytes encode_event_block(EventBlockHeader& header, const EventBlock& block) {
  header.last = block.last();
  ByteWriter w;
  w.reserve(block.events.size() + 64);
  w.put(header.time_us);
  const std::size_t bytes_at = w.size();
  w.put(std::uint64_t{0});
  put_position(w, header.before);
  put_position(w, header.last);
  put_unsigned(w, block.count);
  w.put_bytes(block.events.bytes());
  constexpr std::size_t kSeal = 12;  // what seal() adds
  header.bytes_through += w.size() + kSeal;
  w.patch(bytes_at, header.bytes_through);
  return seal(kBlockKind, kEventsVersion, w.bytes());
}

Result<EventBlockHeader> decode_event_block_header(ByteSpan bytes) {
  ByteReader r({});
  return open_block(bytes, r);
}

Result<EventBlockHeader> decode_event_block(ByteSpan bytes, std::vector<Event>& events) {
  ByteReader r({});
  const auto header = open_block(bytes, r);
  if (!header.ok()) return header;
  const std::size_t before = events.size();
  const std::size_t count = varint::get_count(r);
  EventContext context;
  for (std::size_t i = 0; i < count; ++i) {
    Event event;
    const EventPosition previous = i == 0 ? header->before : context.at;
    if (!get_event(r, context, event) || event.at <= previous) {
      fail_reads(r);
      break;
    }
    events.push_back(std::move(event));
  }
  if (count == 0 || !r.at_end() || context.at != header->last) {
    events.resize(before);
    return not_whole("block of events");
  }
  return header;
}

Bytes encode_event_head(const EventLogHead& head) {
  ByteWriter w;
  put_position(w, head.oldest);
  put_position(w, head.newest);
  w.put(head.bytes_through);
  return seal(kHeadKind, kEventsVersion, w.bytes());
}

Result<EventLogHead> decode_event_head(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kEventsVersion, kEventsVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  EventLogHead head;
  head.oldest = get_position(r);
  head.newest = get_position(r);
  head.bytes_through = r.get<std::uint64_t>();
  if (sealed->kind != kHeadKind || !r.at_end() || head.oldest > head.newest) return not_whole("head of the events");
  return head;
}

}  // namespace relmap::storage
