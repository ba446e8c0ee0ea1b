#include "frontend/publishing/publisher_core.h"

#include <algorithm>
#include <iterator>

namespace relmap::publishing {

namespace {

using std::chrono::milliseconds;
// A part that the daemon asks for is not sent again sooner than this, since the first one may still be on its way.
constexpr milliseconds kAskedAgain{60}, kLosslessAsked{1000};
// What the daemon neither holds nor asks for is sent again after this time, which grows over a lossy transport.
constexpr milliseconds kFirstRetry{250}, kLastRetry{2000}, kLosslessRetry{10'000};
constexpr milliseconds kSilence{1500};  // after this time without a message the daemon may be gone
// A daemon that has acknowledged less than before for so long has forgotten what it had settled before it took the
// first keyframe. Such acknowledgements may also have been overtaken on their way, but not for so long.
constexpr milliseconds kOvertaken{2000};
constexpr std::ptrdiff_t kKeepSettled = 64;  // one acknowledgement settles at most so many (the daemon's window)
constexpr std::uint64_t kMinWindow = std::uint64_t{128} << 10;
constexpr std::uint64_t kMaxWindow = std::uint64_t{2} << 20;
constexpr std::uint64_t kMaxGapSpan = 1'000'000;  // sequences in one message

}  // namespace

void PublisherCore::load_keyframe(std::uint32_t sequence, std::uint32_t crc, std::uint32_t bytes) {
  Item item;
  item.to = sequence;
  item.crc = crc;
  item.bytes = bytes;
  item.loaded = true;
  const auto [it, fresh] = items_.emplace(sequence, std::move(item));
  if (!fresh) return;
  ++unsettled_;
  unsettled_bytes_ += bytes;
  next_ = std::max(next_, sequence + std::uint64_t{1});
}

void PublisherCore::load_gap(const Gap& gap) {
  give_up(gap);
  for (auto it = items_.lower_bound(gap.from); it != items_.end() && it->first <= gap.to; ++it)
    it->second.loaded = true;
  counts_.gaps = 0;
}

std::optional<Gap> PublisherCore::skipped(std::uint32_t sequence) const {
  if (sequence <= next_) return std::nullopt;
  return Gap{session_, static_cast<std::uint32_t>(next_), sequence - 1, Reason::CAPTURE_FAILED};
}

void PublisherCore::push(std::uint32_t sequence, std::uint32_t crc, std::uint32_t bytes) {
  if (const auto gap = skipped(sequence)) give_up(*gap);
  load_keyframe(sequence, crc, bytes);
  items_.at(sequence).loaded = options_.repeated;
  if (!options_.repeated) return;
  settle_below(acknowledged_);
  forget_settled();
}

// The gap replaces the unsettled keyframes of its range and is merged with a gap just before it.
void PublisherCore::give_up(const Gap& gap) {
  std::uint32_t from = gap.from;
  for (auto it = items_.lower_bound(gap.from); it != items_.end() && it->first <= gap.to;) {
    if (it->second.settled) {
      from = it->second.to + 1;
      ++it;
      continue;
    }
    if (!it->second.gap) {
      --unsettled_;
      unsettled_bytes_ -= it->second.bytes;
    }
    it = items_.erase(it);
  }
  if (from > gap.to) return;
  counts_.gaps += gap.to - from + std::uint64_t{1};
  next_ = std::max(next_, gap.to + std::uint64_t{1});
  // A gap that was sent is not extended, since the daemon may have it already.
  if (const auto after = items_.lower_bound(from); after != items_.begin()) {
    auto& [start, before] = *std::prev(after);
    if (before.gap && !before.settled && before.sends == 0 && before.reason == gap.reason &&
        before.to + std::uint64_t{1} >= from) {
      before.to = std::max(before.to, gap.to);
      return;
    }
  }
  Item item;
  item.gap = true;
  item.to = gap.to;
  item.reason = gap.reason;
  items_[from] = std::move(item);
}

std::optional<Gap> PublisherCore::oldest_to_drop() const {
  for (const auto& [sequence, item] : items_)
    if (!item.gap && !item.settled && !item.held) return Gap{session_, sequence, sequence, Reason::DROPPED_BY_ROBOT};
  return std::nullopt;
}

void PublisherCore::set_settled(Item& item, std::uint32_t sequence, bool settled) {
  if (item.settled == settled) return;
  item.settled = settled;
  const std::uint64_t sequences = item.to - sequence + std::uint64_t{1};
  if (settled) {
    counts_.settled += sequences;
    if (item.refused != Reason::OK) ++counts_.refused[item.refused];
  } else {
    counts_.settled -= sequences;
    if (item.refused != Reason::OK) --counts_.refused[item.refused];
    item.refused = Reason::OK;
    item.held = false;
    item.sends = 0;
    item.loaded = true;  // the daemon may have it after all
  }
  if (item.gap) return;
  if (settled) {
    --unsettled_;
    unsettled_bytes_ -= item.bytes;
  } else {
    ++unsettled_;
    unsettled_bytes_ += item.bytes;
  }
}

// A new daemon process: what the one before held in memory is lost.
void PublisherCore::adopt_boot(const BootId& boot) {
  const bool first = !boot_;
  if (!first) {
    past_boots_.insert(*boot_);
    ++counts_.restarts_seen;
  }
  boot_ = boot;
  if (first) return;
  for (auto& [sequence, item] : items_) {
    item.held = false;
    item.wanted = !item.settled && item.sends > 0;
    item.parts.clear();
    item.last_sent = {};
  }
}

void PublisherCore::settle_below(std::uint64_t next) {
  for (auto& [sequence, item] : items_) {
    if (item.to >= next) break;
    // The daemon knows a keyframe that was never sent, so another source has used this uuid.
    if (!item.settled && !item.gap && item.sends == 0 && !item.loaded && item.refused == Reason::OK)
      item.refused = Reason::SEQUENCE_CONFLICT;
    // The daemon already had these before they were given up, for example from an earlier part of the recording.
    if (item.gap && !item.settled && item.sends == 0 && !item.loaded) {
      counts_.gaps -= item.to - sequence + std::uint64_t{1};
      if (item.reason == Reason::MAP_RESTORED) counts_.lost_in_restores -= item.to - sequence + std::uint64_t{1};
    }
    set_settled(item, sequence, true);
  }
  acknowledged_ = next;
}

// The daemon has lost settled keyframes, which will be sent again.
void PublisherCore::unsettle_from(std::uint64_t next) {
  for (auto it = items_.rbegin(); it != items_.rend() && it->second.to >= next; ++it)
    set_settled(it->second, it->first, false);
}

// Declares gaps for sequences that the daemon lacks and the spool no longer has.
void PublisherCore::fill_holes(std::uint64_t from, Reason reason) {
  std::vector<Gap> holes;
  for (const auto& [sequence, item] : items_) {
    if (sequence > from) holes.push_back({session_, static_cast<std::uint32_t>(from), sequence - 1, reason});
    from = std::max(from, item.to + std::uint64_t{1});
  }
  for (const Gap& hole : holes) {
    if (reason == Reason::MAP_RESTORED) counts_.lost_in_restores += hole.to - hole.from + std::uint64_t{1};
    give_up(hole);
    holes_.push_back(hole);
  }
}

void PublisherCore::mark_held(const std::vector<SequenceRange>& held) {
  // A list of maximum length may be incomplete, so it says nothing beyond its end.
  const std::uint64_t known = held.size() < kMaxAckRanges ? UINT64_MAX : held.back().to;
  auto range = held.begin();
  for (auto& [sequence, item] : items_) {
    if (item.settled) continue;
    const std::uint64_t first = std::max<std::uint64_t>(sequence, acknowledged_);
    if (first > known) break;
    while (range != held.end() && range->to < first) ++range;
    const bool now_held = range != held.end() && range->from <= first && item.to <= range->to;
    if (item.held && !now_held) item.wanted = true;  // the daemon could not keep it
    item.held = now_held;
  }
}

void PublisherCore::want_missing(const Acknowledgement& ack, Time now) {
  const auto due = [&](const Item& item) {
    return !item.settled && !item.held && item.sends > 0 &&
           now - item.last_sent >= (options_.lossless ? kLosslessAsked : kAskedAgain);
  };
  bool lost = false;
  for (const SequenceRange& range : ack.missing)
    for (auto it = items_.lower_bound(range.from); it != items_.end() && it->first <= range.to; ++it)
      if (due(it->second)) lost = it->second.wanted = true;
  for (const MissingParts& missing : ack.incomplete) {
    const auto it = items_.find(missing.sequence);
    if (it == items_.end() || it->second.gap || it->second.crc != missing.payload_crc || !due(it->second)) continue;
    it->second.parts = missing.parts;
    lost = true;
  }
  window_bytes_ =
      lost ? std::max(kMinWindow, window_bytes_ * 3 / 4) : std::min(kMaxWindow, window_bytes_ + kMinWindow / 2);
}

PublisherCore::Progress PublisherCore::progress_of(const Acknowledgement& ack, Time now) {
  if (ack.next_sequence >= acknowledged_) return Progress::kAhead;
  if (!behind_since_) behind_since_ = now;
  return now - *behind_since_ < kOvertaken ? Progress::kOvertaken : Progress::kForgotten;
}

void PublisherCore::acknowledge(const Acknowledgement& ack, Time now) {
  if (ack.session != session_ || past_boots_.count(ack.boot)) return;
  if (!maps_.believes(ack.boot, now)) return;
  const bool fresh_boot = !boot_ || *boot_ != ack.boot;
  const Progress progress = fresh_boot ? Progress::kAhead : progress_of(ack, now);
  if (progress == Progress::kOvertaken) return;
  behind_since_.reset();
  last_ack_ = now;
  if (fresh_boot) adopt_boot(ack.boot);
  closed_ = Reason::OK;
  for (const Refused& refused : ack.refused) {
    if (refused.sequence == kWholeSession) closed_ = refused.reason;
    const auto it = items_.find(refused.sequence);
    if (it == items_.end() || it->second.gap || it->second.crc != refused.payload_crc) continue;
    // A keyframe that was settled before it was sent may turn out to be another version.
    if (it->second.settled && it->second.refused == Reason::OK) ++counts_.refused[refused.reason];
    it->second.refused = refused.reason;
  }
  if (fresh_boot || progress == Progress::kForgotten) {
    unsettle_from(ack.next_sequence);
    fill_holes(ack.next_sequence, maps_.restored(ack.boot) ? Reason::MAP_RESTORED : Reason::DROPPED_BY_ROBOT);
  }
  maps_.acknowledged_by(ack.boot);
  settle_below(ack.next_sequence);
  send_end_ = ack.next_sequence + ack.credits;
  mark_held(ack.held);
  want_missing(ack, now);
  forget_settled();
}

void PublisherCore::broken() {
  maps_.broken();
  for (auto& [sequence, item] : items_) item.wanted |= !item.settled && !item.held && item.sends > 0;
}

void PublisherCore::forget_settled() {
  const std::uint64_t keep = keep_from();
  while (!items_.empty() && items_.begin()->second.to < keep) items_.erase(items_.begin());
}

std::uint64_t PublisherCore::keep_from() const {
  const auto open = std::find_if(items_.begin(), items_.end(), [](const auto& entry) { return !entry.second.settled; });
  const std::ptrdiff_t settled = std::distance(items_.begin(), open);
  if (items_.empty()) return next_;
  return std::next(items_.begin(), std::max<std::ptrdiff_t>(0, settled - kKeepSettled))->first;
}

bool PublisherCore::due_again(const Item& item, Time now, bool probing) const {
  if (item.held) return false;
  const milliseconds growing = std::min(kLastRetry, kFirstRetry * (1 << std::min(item.sends - 1, 3u)));
  return now - item.last_sent >= (!options_.lossless ? growing : probing ? kLastRetry : kLosslessRetry);
}

PublisherCore::Send PublisherCore::make_send(std::uint32_t sequence, Item& item, Time now, std::uint32_t part_bytes) {
  Send send;
  send.sequence = sequence;
  send.gap = item.gap;
  send.to = item.to;
  send.reason = item.reason;
  if (item.gap) {
    send.sequence = static_cast<std::uint32_t>(std::max<std::uint64_t>(sequence, acknowledged_));
    send.to = std::min(
        item.to, static_cast<std::uint32_t>(std::min<std::uint64_t>(UINT32_MAX, send.sequence + kMaxGapSpan - 1)));
  } else if (!item.parts.empty() && !item.wanted) {
    const std::uint32_t parts = count_parts(item.bytes, part_bytes);
    for (const std::uint32_t part : item.parts)
      if (part < parts) send.parts.push_back(part);
    counts_.parts_resent += send.parts.size();
  } else {
    ++(item.sends == 0 ? counts_.sent : counts_.resent);
  }
  // A gap of an earlier process counts when this process sends it.
  if (item.gap && item.loaded && item.sends == 0) counts_.gaps += item.to - sequence + std::uint64_t{1};
  item.parts.clear();
  item.wanted = false;
  ++item.sends;
  item.last_sent = now;
  return send;
}

// Sends one item now and then until the daemon answers.
std::vector<PublisherCore::Send> PublisherCore::probe(Time now, std::uint32_t part_bytes) {
  for (auto& [sequence, item] : items_) {
    if (item.settled) continue;
    // Gaps are not used to probe: a daemon that does not know the session yet cannot know its gaps, and one that does
    // may have their keyframes.
    if (item.gap && sequence != items_.rbegin()->first) continue;
    item.held = false;
    if (item.sends > 0 && !item.wanted && !due_again(item, now, true)) return {};
    return {make_send(sequence, item, now, part_bytes)};
  }
  return {};
}

std::vector<PublisherCore::Send> PublisherCore::poll(Time now, std::uint32_t part_bytes) {
  maps_.wait_since(now);
  if (!may_send(now)) return {};
  if (!boot_ || now - last_ack_ >= kSilence) return probe(now, part_bytes);
  std::vector<Send> sends;
  std::uint64_t under_way = 0;
  for (auto& [sequence, item] : items_) {
    if (item.settled) continue;
    if (sequence >= send_end_ || under_way >= window_bytes_) break;
    if (item.sends == 0 || item.wanted || !item.parts.empty() || due_again(item, now, false))
      sends.push_back(make_send(sequence, item, now, part_bytes));
    if (!item.held) under_way += item.bytes;
  }
  return sends;
}

}  // namespace relmap::publishing
