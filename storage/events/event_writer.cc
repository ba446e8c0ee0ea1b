#include "storage/events/event_writer.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "storage/events/event_head.h"
#include "storage/format/keys.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kFrameEntry = 64;  // bytes of a node of a tree of frames

std::string key_of(EventPosition last) { return keys::events(last.sequence, last.ordinal); }
// The first key behind that of the block.
std::string behind(EventPosition last) { return key_of(last) + '\0'; }

}  // namespace

Status EventWriter::open(const EngineSnapshot& snapshot, std::uint64_t applied_sequence) {
  Status read = [&]() -> Status {
    const auto head = load_event_head(snapshot);
    if (head.reason() == Reason::IO_ERROR) return head.status();
    if (head.ok() && *head)
      head_ = **head;
    else if (Status found = find_head(snapshot); !found.ok())
      return found;
    has_head_ = head_.newest != EventPosition();
    if (!has_head_) return {};
    const auto oldest = first_behind(snapshot, key_of(head_.oldest));
    if (oldest.ok()) oldest_ = *oldest;
    return oldest.status();
  }();
  if (read.reason() != Reason::DATA_LOSS) return read;
  // All that was told before counts as lost.
  has_head_ = true;
  head_ = {head_.oldest, {applied_sequence, kMovedOrdinal}, head_.bytes_through};
  return {};
}

// Without a head there are no blocks either, unless the head was lost.
Status EventWriter::find_head(const EngineSnapshot& snapshot) {
  return snapshot.scan_from(keys::all_events(), key_of({}), [this](std::string_view key, ByteSpan value) {
    const auto at = keys::events_of(key);
    if (!at) return true;
    head_.newest = {at->sequence, at->ordinal};
    if (head_.oldest == EventPosition()) head_.oldest = head_.newest;
    if (const auto header = decode_event_block_header(value); header.ok())
      head_.bytes_through = std::max(head_.bytes_through, header->bytes_through);
    return true;
  });
}

// The first block from `key` on. One that cannot be read is as old as can be.
Result<std::optional<EventWriter::Oldest>> EventWriter::first_behind(const EngineSnapshot& snapshot,
                                                                     const std::string& key) {
  std::optional<Oldest> found;
  const Status scanned = snapshot.scan_from(keys::all_events(), key, [&](std::string_view at, ByteSpan value) {
    const auto last = keys::events_of(at);
    if (!last) return true;
    found = Oldest();
    found->last = {last->sequence, last->ordinal};
    if (const auto header = decode_event_block_header(value); header.ok()) {
      found->time_us = header->time_us;
      found->bytes_before = header->bytes_through - std::min<std::uint64_t>(header->bytes_through, value.size());
    }
    return false;
  });
  if (!scanned.ok()) return scanned;
  return found;
}

void EventWriter::record(const Event& event) {
  if (kept_.blocks.empty() || kept_.blocks.back().events.size() >= kEventBlockBytes) kept_.blocks.emplace_back();
  EventBlock& block = kept_.blocks.back();
  const std::size_t before = block.events.size();
  block.add(event);
  kept_.block_bytes += block.events.size() - before;
  if (const auto* added = std::get_if<FrameAddedEvent>(&event.content)) add_frame(kept_.added, added->frame);
}

void EventWriter::note_moved(FrameId frame) { add_frame(kept_.moved, frame); }

void EventWriter::add_frame(Frames& frames, FrameId id) { frames[chunk_id(id)] |= std::uint64_t{1} << slot_of(id); }

std::size_t EventWriter::memory_bytes() const {
  return kept_.block_bytes + kept_.blocks.size() * sizeof(EventBlock) +
         (kept_.added.size() + kept_.moved.size()) * kFrameEntry;
}

// Frames that moved, without those that were added since the commit before: what these are is told as well.
std::vector<FrameRange> EventWriter::moved_ranges(const Kept& kept) {
  std::vector<FrameRange> ranges;
  for (const auto& [chunk, moved] : kept.moved) {
    const auto added = kept.added.find(chunk);
    const std::uint64_t slots = moved & ~(added == kept.added.end() ? 0 : added->second);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      if (((slots >> slot) & 1) == 0) continue;
      const FrameId frame = frame_in(chunk, slot);
      if (!ranges.empty() && ranges.back().session == frame.session && ranges.back().last + 1 == frame.index)
        ranges.back().last = frame.index;
      else
        ranges.push_back({frame.session, frame.index, frame.index});
    }
  }
  return ranges;
}

void EventWriter::begin_commit(const EngineSnapshot& snapshot, std::uint64_t applied_sequence, std::int64_t now_us,
                               std::vector<Put>& puts, std::vector<std::string>& deletes) try {
  failed();  // a commit that was given up before it began
  begun_ = Begun{std::exchange(kept_, {}), has_head_, head_, oldest_};
  // Given back as it was if the commit fails, so the last block is not the one to which this is added.
  std::optional<EventBlock> last;
  if (std::vector<FrameRange> ranges = moved_ranges(begun_->kept); !ranges.empty()) {
    const Event moved{{applied_sequence, kMovedOrdinal}, {now_us, {}}, {}, FramesMovedEvent{std::move(ranges)}};
    last = begun_->kept.blocks.empty() ? EventBlock() : begun_->kept.blocks.back();
    last->add(moved);
  }
  std::size_t written = 0;
  std::optional<Oldest> fresh;  // of the blocks that this commit writes
  const auto write = [&](const EventBlock& block) {
    EventBlockHeader header{now_us, head_.newest, {}, head_.bytes_through};
    Bytes bytes = encode_event_block(header, block);
    if (!fresh) fresh = Oldest{header.last, now_us, head_.bytes_through};
    head_.newest = header.last;
    head_.bytes_through = header.bytes_through;
    puts.push_back({key_of(header.last), std::move(bytes)});
    ++written;
  };
  const std::vector<EventBlock>& blocks = begun_->kept.blocks;
  const std::size_t whole = blocks.size() - (last && !blocks.empty() ? 1 : 0);
  for (std::size_t i = 0; i < whole; ++i) write(blocks[i]);
  if (last) write(*last);
  if (written == 0) return;
  constexpr std::size_t kMore = 8;  // so that what is too much after a change of the limits goes in time
  delete_old(snapshot, now_us, written + kMore, deletes);
  if (!oldest_) oldest_ = fresh;
  head_.oldest = oldest_->last;
  has_head_ = true;
  puts.push_back({std::string(keys::all_events()), encode_event_head(head_)});
} catch (...) {
  failed();
  throw;
}

bool EventWriter::is_too_old(const Oldest& oldest, std::int64_t now_us) const {
  return now_us - oldest.time_us > limits_.max_age_us || head_.bytes_through - oldest.bytes_before > limits_.max_bytes;
}

// Deletes blocks of the snapshot, at most so many. What the commit itself writes stays.
void EventWriter::delete_old(const EngineSnapshot& snapshot, std::int64_t now_us, std::size_t most,
                             std::vector<std::string>& deletes) {
  for (; most > 0 && oldest_ && is_too_old(*oldest_, now_us); --most) {
    const auto next = first_behind(snapshot, behind(oldest_->last));
    if (!next.ok()) return;  // it goes when the disk can be read
    deletes.push_back(key_of(oldest_->last));
    oldest_ = *next;
  }
}

void EventWriter::committed() { begun_.reset(); }

void EventWriter::failed() {
  if (!begun_) return;
  has_head_ = begun_->had_head;
  head_ = begun_->head;
  oldest_ = begun_->oldest;
  Kept later = std::exchange(kept_, std::move(begun_->kept));
  begun_.reset();
  std::move(later.blocks.begin(), later.blocks.end(), std::back_inserter(kept_.blocks));
  kept_.block_bytes += later.block_bytes;
  for (const auto& [chunk, frames] : later.added) kept_.added[chunk] |= frames;
  for (const auto& [chunk, frames] : later.moved) kept_.moved[chunk] |= frames;
}

}  // namespace relmap::storage
