#include "frontend/recording/keyframe_log.h"

#include <algorithm>
#include <utility>

#include "proto/keyframe/keyframe.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::recording {

namespace {

constexpr std::size_t kWaitingOverhead = 512;  // approximate memory of a waiting keyframe besides its bytes
constexpr std::size_t kVersion = 48;           // bytes of memory for each completed payload
constexpr std::size_t kRemembered = 65'536;    // number of keyframes whose repeats are recognised
constexpr std::size_t kMaxGaps = 4096;

}  // namespace

Result<KeyframeLog> KeyframeLog::open(const std::string& path, const std::string& choice) {
  auto log = EventLog::open(path);
  if (!log.ok()) return log.status();
  return open(std::move(*log), choice);
}

Result<KeyframeLog> KeyframeLog::open(EventLog log, const std::string& choice) {
  const auto sessions = list_sessions(log);
  if (!sessions.ok()) return sessions.status();
  auto session = choose_session(log.name(), *sessions, choice);
  if (!session.ok()) return session.status();
  return KeyframeLog(std::move(log), std::move(*session));
}

Result<std::optional<Keyframe>> KeyframeLog::next() {
  for (;;) {
    while (!ended_ && !lowest_is_due()) read_event();
    if (waiting_.empty()) {
      skip_to(std::uint64_t{session_.last} + 1);
      if (!end_.ok()) return end_;
      return std::optional<Keyframe>();
    }
    if (auto keyframe = give_lowest()) return keyframe;
  }
}

std::map<Reason, std::uint64_t> KeyframeLog::left_out() const {
  auto counts = left_out_;
  if (log_.damages() > 0) counts[Reason::CORRUPT] += log_.damages();
  return counts;
}

void KeyframeLog::read_event() {
  const auto event = log_.next();
  if (!event.ok() || !event->has_value()) {
    ended_ = true;
    end_ = event.status();
  } else if ((*event)->channel == kKeyframeChannel) {
    if (const auto part = read_part(log_.data(**event)); part.ok())
      take(*part);
    else
      ++left_out_[part.reason()];
  } else if ((*event)->channel == kGapChannel) {
    if (const auto gap = decode_lcm_gap(log_.data(**event)); gap.ok())
      take(*gap);
    else
      ++left_out_[gap.reason()];
  }
}

void KeyframeLog::take(const KeyframePart& part) {
  if (part.session != session_.header.uuid || part.sequence < remembered_from_) return;
  const std::pair version(part.sequence, part.payload_crc);
  if (whole_.contains(version)) return;
  auto payload = assembler_.add(part);
  if (!payload.ok()) ++left_out_[payload.reason()];
  if (!payload.ok() || !payload->has_value()) return;
  const auto other = whole_.lower_bound({part.sequence, 0});
  const bool conflict = other != whole_.end() && other->first == part.sequence;
  whole_.insert(version);
  if (conflict) {
    ++left_out_[Reason::SEQUENCE_CONFLICT];
  } else if (part.sequence >= next_) {  // otherwise it was counted as lost when it was skipped
    waiting_bytes_ += (*payload)->size() + kWaitingOverhead;
    waiting_.emplace(part.sequence, std::move(**payload));
  }
}

void KeyframeLog::take(const Gap& gap) {
  if (gap.session != session_.header.uuid || gap.to < std::max<std::uint64_t>(gap.from, next_)) return;
  Gap& known = gaps_.emplace(gap.from, gap).first->second;
  if (known.to < gap.to) known = gap;
  if (gaps_.size() > kMaxGaps) gaps_.erase(gaps_.begin());
}

bool KeyframeLog::lowest_is_due() const {
  if (waiting_.empty()) return false;
  return waiting_.begin()->first == next_ || waiting_bytes_ + whole_.size() * kVersion > kMaxWaitingBytes;
}

std::optional<Keyframe> KeyframeLog::give_lowest() {
  const auto lowest = waiting_.extract(waiting_.begin());
  const std::uint32_t sequence = lowest.key();
  const Bytes& payload = lowest.mapped();
  waiting_bytes_ -= payload.size() + kWaitingOverhead;
  skip_to(sequence);
  ++next_;
  for (; whole_.size() > kRemembered && whole_.begin()->first < next_; whole_.erase(whole_.begin()))
    remembered_from_ = whole_.begin()->first + 1;

  auto keyframe = decode_keyframe(payload);
  Reason reason = keyframe.reason();
  if (keyframe.ok()) {
    const SessionHeader& header = keyframe->session;
    if (header.uuid != session_.header.uuid || keyframe->sequence != sequence)
      reason = Reason::CORRUPT;
    else if (!same_camera(session_.header, header))
      reason = Reason::CALIBRATION_CHANGED;
    else
      return std::move(*keyframe);
  }
  ++left_out_[reason];
  return std::nullopt;
}

// Counts the sequences that are missing before `sequence`: those in gaps, and those lost on the way.
void KeyframeLog::skip_to(std::uint64_t sequence) {
  while (next_ < sequence) {
    while (!gaps_.empty() && gaps_.begin()->second.to < next_) gaps_.erase(gaps_.begin());
    const bool none = gaps_.empty() || gaps_.begin()->first >= sequence;
    if (none || gaps_.begin()->first > next_) {
      const std::uint64_t end = none ? sequence : gaps_.begin()->first;
      left_out_[Reason::DATA_LOSS] += end - next_;
      next_ = end;
    } else {
      const Gap& gap = gaps_.begin()->second;
      const std::uint64_t end = std::min<std::uint64_t>(sequence, std::uint64_t{gap.to} + 1);
      left_out_[gap.reason] += end - next_;
      next_ = end;
    }
  }
}

}  // namespace relmap::recording
