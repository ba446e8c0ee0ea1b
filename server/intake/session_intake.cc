#include "server/intake/session_intake.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/names.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::intake {

namespace {

constexpr std::size_t kKeepJudged = 4 * kIntakeWindow;
constexpr std::size_t kMaxBeforeBegin = 1024;
constexpr std::size_t kMaxConflicts = 16;

// Checks the keyframe alone. Its place in the session is judged when its turn comes.
Status check_payload(const SessionUuid& uuid, std::uint32_t sequence, const Result<Keyframe>& keyframe) {
  if (!keyframe.ok()) return keyframe.status();
  if (keyframe->session.uuid != uuid || keyframe->sequence != sequence)
    return {Reason::CORRUPT, "the payload is keyframe " + std::to_string(keyframe->sequence) + " of session " +
                                 keyframe->session.uuid.to_string() + ", the envelope says " +
                                 std::to_string(sequence) + " of " + uuid.to_string()};
  return check_keyframe(*keyframe);
}

// A keyframe of the far future would make TIME_BACKWARDS of all that follow. Clocks in another time zone are no fault.
// A server whose own clock has not been set judges nobody's.
Status check_clock(std::int64_t time_us) {
  constexpr std::int64_t kDay = 86'400'000'000, kSet = 1'700'000'000'000'000;
  const std::int64_t now = now_us();
  if (now < kSet || time_us <= now + kDay) return {};
  return {Reason::TIME_AHEAD,
          "the time stamp is " + std::to_string((time_us - now) / kDay) + " days ahead of the server's clock"};
}

}  // namespace

SessionIntake::SessionIntake(const SessionUuid& uuid, KeyframeSink& sink, const KnownSession& known, Submit submit,
                             Begin begin, IngestStats& stats, const std::set<std::string>& robots,
                             const std::set<std::string>& proving)
    : uuid_(uuid),
      sink_(sink),
      submit_(std::move(submit)),
      begin_(std::move(begin)),
      stats_(stats),
      robots_(robots),
      proving_(proving) {
  const auto& session = known.session;
  if (!session) return;
  record_ = known.held;
  number_ = session->number;
  header_ = session->header;
  ended_ = session->state == storage::SessionState::kEnded;
  durable_ = turn_ = seen_ = session->next_sequence;
  if (session->frames > 0) durable_time_us_ = turn_time_us_ = session->last_time_us;
  for (const storage::Skipped& settled : known.skipped)
    if (settled.refused) remember_refusal(settled.from, settled.crc, settled.reason);
}

// What the map knows of the session; where it cannot be read, as it was read last.
std::optional<storage::Session> SessionIntake::session() const try {
  if (number_)
    if (auto now = sink_.view()->session(*number_)) last_read_ = std::move(now);
  return last_read_;
} catch (const StatusError&) {
  return last_read_;
}

void SessionIntake::know(std::uint32_t sequence, const Judged& judged) {
  prune_judged();
  judged_.emplace(sequence, judged);
}

Judged SessionIntake::judged(std::uint32_t sequence) {
  if (const auto it = judged_.find(sequence); it != judged_.end()) return it->second;
  if (!number_) return {0, Reason::OK, true};
  const MapAnswer found = answer(sink_, {uuid_, *number_, sequence});
  throw_if(found.failed);
  know(sequence, found.judged);
  return found.judged;
}

SessionIntake::Verdict SessionIntake::classify(std::uint32_t sequence, std::uint32_t crc) {
  if (sequence < turn_) {
    const Judged known = judged(sequence);
    if (!known.gap && known.crc == crc) return Verdict::kRepeat;
    // Other keyframes of a deleted session are no conflict between two robots: the recording is being taken in again.
    if (judge_session().reason() == Reason::SESSION_DELETED) return Verdict::kDeleted;
    return known.gap ? Verdict::kSettled : Verdict::kConflict;
  }
  if (const auto it = held_.find(sequence); it != held_.end())
    return it->second.crc == crc ? Verdict::kRepeat : Verdict::kConflict;
  if (sequence >= durable_ + kIntakeWindow || sequence > kMaxSequence) return Verdict::kTooFar;
  auto gap = given_up_.upper_bound(sequence);
  if (gap != given_up_.begin() && std::prev(gap)->second.to >= sequence) return Verdict::kSettled;
  return Verdict::kTake;
}

Status SessionIntake::take(std::uint32_t sequence, Reassembly::Payload payload, const Sender& sender) {
  seen(sequence);
  const Result<Keyframe> keyframe = decode_keyframe(payload.bytes);
  Held held;
  held.crc = payload.crc;
  held.verdict = check_payload(uuid_, sequence, keyframe);
  if (held.verdict.ok() && !robots_.empty() && !robots_.contains(keyframe->session.robot))
    held.verdict = {Reason::NOT_ALLOWED, "robot " + keyframe->session.robot + " is not on the list"};
  if (held.verdict.ok() && !sender.robot.empty() && keyframe->session.robot != sender.robot)
    held.verdict = {Reason::NOT_ALLOWED, sender.robot + " sent a keyframe of robot " + keyframe->session.robot};
  if (held.verdict.ok() && sender.anyone && proving_.contains(keyframe->session.robot))
    held.verdict = {Reason::NOT_ALLOWED, "robot " + keyframe->session.robot + " must prove who it is"};
  if (held.verdict.ok()) held.verdict = check_clock(keyframe->time_us);
  const Status verdict = held.verdict;
  if (verdict.ok()) {
    held.time_us = keyframe->time_us;
    held.header = keyframe->session;
    if (number_)
      held.header.unknown.clear();  // extensions come from the session's first keyframe
    else
      header_ = keyframe->session;
    held.payload = std::move(payload.bytes);
    held.charge = std::move(payload.charge);
  }
  if (!verdict.ok() && keyframe.ok()) note_claim(keyframe->session);
  waiting_bytes_ += held.payload.size();
  held_.emplace(sequence, std::move(held));
  return verdict;
}

// So that whoever looks for a robot of which everything is refused finds it by its name.
void SessionIntake::note_claim(const SessionHeader& header) {
  if (number_ || !header_.uuid.is_nil()) return;
  if (check_name("robot", header.robot).ok()) claimed_robot_ = header.robot;
  if (check_name("session", header.name).ok()) claimed_name_ = header.name;
}

void SessionIntake::give_up(std::uint32_t from, std::uint32_t to, Reason reason) {
  if (to < turn_ || from >= durable_ + kIntakeWindow || given_up_.size() >= kIntakeWindow) return;
  from = std::max(from, static_cast<std::uint32_t>(turn_));
  auto [it, fresh] = given_up_.try_emplace(from, GivenUp{to, reason});
  if (!fresh) it->second.to = std::max(it->second.to, to);
  seen(from);
}

void SessionIntake::seen(std::uint32_t sequence) {
  if (sequence < durable_ + kIntakeWindow) seen_ = std::max(seen_, std::uint64_t{sequence} + 1);
}

void SessionIntake::note_conflict(std::uint32_t sequence, std::uint32_t crc, Reason reason) {
  for (const Refused& r : conflicts_)
    if (r.sequence == sequence && r.payload_crc == crc) return;
  conflicts_.push_back({sequence, crc, reason});
  ++stats_.keyframes_refused[index_of(reason)];
  if (conflicts_.size() > kMaxConflicts) conflicts_.pop_front();
}

bool SessionIntake::has_next() const {
  return (turn_ <= UINT32_MAX && held_.contains(static_cast<std::uint32_t>(turn_))) ||
         (!given_up_.empty() && given_up_.begin()->first <= turn_);
}

bool SessionIntake::submit_next() {
  if (broken_) return false;
  const Status before = std::exchange(blocked_, {});
  const bool submitted = submit_in_turn();
  if (beginning_) blocked_ = before;  // whether it is over, the outcome will tell
  return submitted;
}

bool SessionIntake::submit_in_turn() {
  if (const auto it = held_.find(static_cast<std::uint32_t>(turn_)); turn_ <= UINT32_MAX && it != held_.end()) {
    if (!judge_keyframe(it->first, it->second)) return false;
    waiting_bytes_ -= it->second.payload.size();
    held_.erase(it);
    return true;
  }
  while (!given_up_.empty() && given_up_.begin()->second.to < turn_) given_up_.erase(given_up_.begin());
  // Gives up a range, except the sequences of it that came all the same.
  const auto gap = given_up_.begin();
  if (gap == given_up_.end() || gap->first > turn_) return false;
  const auto next_held = held_.lower_bound(static_cast<std::uint32_t>(turn_));
  const std::uint32_t to = next_held == held_.end() ? gap->second.to : std::min(gap->second.to, next_held->first - 1);
  return judge_gap(to, gap->second.reason);
}

// Not OK if an operator has frozen or deleted the session.
Status SessionIntake::judge_session() const {
  const auto now = session();
  if (!now) return {};
  if (storage::is_frozen(*now)) return {Reason::SESSION_FROZEN, "session " + now->display_name + " is frozen"};
  if (storage::is_going(*now)) return {Reason::SESSION_DELETED, "session " + now->display_name + " was deleted"};
  return {};
}

Status SessionIntake::judge_in_turn(const Held& held) const {
  if (!held.verdict.ok()) return held.verdict;
  if (Status status = judge_session(); !status.ok()) return status;
  if (number_) {
    if (!same_camera(header_, held.header))
      return {Reason::CALIBRATION_CHANGED, "camera or flags differ from those that the session began with"};
    if (held.header.robot != header_.robot || held.header.name != header_.name)
      return {Reason::BAD_NAME, "robot or name differs from those that the session began with"};
  }
  if (turn_time_us_ && held.time_us <= *turn_time_us_)
    return {Reason::TIME_BACKWARDS, std::to_string(held.time_us) + " us after " + std::to_string(*turn_time_us_)};
  return {};
}

bool SessionIntake::judge_keyframe(std::uint32_t sequence, Held& held) {
  const Status verdict = judge_in_turn(held);
  if (verdict.ok()) {
    if (!number_) {
      // Until it has begun, what was settled may be forgotten, because the robot can send it again.
      if (!beginning_) begin_(*(beginning_ = held.header));
      return false;
    }
    // Submits a copy, because it is submitted again if the sink has no room.
    if (!submit(storage::KeyframeRecord{*number_, held.crc, held.payload}, sequence + std::uint64_t{1}, held.time_us,
                true))
      return false;
    turn_time_us_ = held.time_us;
    ended_ = false;
  } else {
    if (!submit(storage::RefusalRecord{number_.value_or(0), sequence, held.crc, verdict.reason()},
                sequence + std::uint64_t{1}, 0, false))
      return false;
    remember_refusal(sequence, held.crc, verdict.reason());
    ++stats_.keyframes_refused[index_of(verdict.reason())];
    ++refusals_[verdict.reason()];
  }
  judged_[sequence] = {held.crc, verdict.reason(), false};
  return true;
}

bool SessionIntake::judge_gap(std::uint32_t to, Reason reason) {
  const auto from = static_cast<std::uint32_t>(turn_);
  if (!submit(storage::GapRecord{number_.value_or(0), from, to, reason}, to + std::uint64_t{1}, 0, false)) return false;
  stats_.sequences_given_up += to - from + std::uint64_t{1};
  // Of a long gap only the beginning is kept; classify() treats an unknown sequence in the same way.
  for (std::uint64_t s = from; s <= to && s < from + std::uint64_t{kIntakeWindow}; ++s)
    judged_[static_cast<std::uint32_t>(s)] = {0, reason, true};
  return true;
}

void SessionIntake::end(std::uint64_t next_sequence) {
  if (!number_ || ended_ || next_sequence != durable_ || !submitted_.empty() || !held_.empty()) return;
  if (!judge_session().ok()) return;
  if (!submit_(storage::SetSessionStateRecord{*number_, storage::SessionState::kEnded}, next_ticket_).ok()) return;
  Submitted end;
  end.ticket = next_ticket_++;
  end.session_end = true;
  submitted_.push_back(std::move(end));
}

// A session begins with its first acceptable keyframe. What was settled before is journalled then.
void SessionIntake::begun(const Result<SessionNumber>& number) {
  const SessionHeader header = *std::exchange(beginning_, std::nullopt);
  blocked_ = number.status();
  if (!number.ok()) return;
  number_ = *number;
  header_ = header;
  record_ = sink_.hold_session(*number);
}

bool SessionIntake::journal_before_begin() {
  while (!before_begin_.empty()) {
    BeforeBegin settled = before_begin_.front();
    std::visit([&](auto& record) { record.session = *number_; }, settled);
    blocked_ =
        submit_(std::visit([](const auto& record) { return storage::JournalRecord(record); }, settled), next_ticket_);
    if (!blocked_.ok()) return false;
    if (const auto* refusal = std::get_if<storage::RefusalRecord>(&settled))
      --stats_.refused_before_begin[index_of(refusal->reason)];
    submitted_.push_back({next_ticket_++, 0, 0, false, false, std::nullopt, settled});
    before_begin_.pop_front();
  }
  return true;
}

bool SessionIntake::submit(storage::JournalRecord record, std::uint64_t end, std::int64_t time_us, bool keyframe) {
  if (!number_) {
    if (before_begin_.size() >= kMaxBeforeBegin) {
      blocked_ = {Reason::NO_SUCH_SESSION, "no acceptable keyframe to begin a session with"};
      return false;
    }
    if (const auto* refusal = std::get_if<storage::RefusalRecord>(&record)) {
      ++stats_.refused_before_begin[index_of(refusal->reason)];
      before_begin_.push_back(*refusal);
    } else {
      before_begin_.push_back(std::get<storage::GapRecord>(record));  // no keyframe: that would have begun the session
    }
    turn_ = durable_ = end;
    return true;
  }
  if (!journal_before_begin()) return false;
  blocked_ = submit_(std::move(record), next_ticket_);
  if (!blocked_.ok()) return false;
  submitted_.push_back({next_ticket_++, end, time_us, keyframe, false, std::nullopt, std::nullopt});
  turn_ = end;
  return true;
}

void SessionIntake::remember_refusal(std::uint32_t sequence, std::uint32_t crc, Reason reason) {
  refused_.push_back({sequence, crc, reason});
  if (refused_.size() > kMaxAckRefused) refused_.pop_front();
}

void SessionIntake::settle(std::uint64_t ticket, const Status& outcome) {
  for (Submitted& s : submitted_)
    if (s.ticket == ticket) s.outcome = outcome;
  while (!submitted_.empty() && submitted_.front().outcome && submitted_.front().outcome->ok()) {
    durable_ = std::max(durable_, submitted_.front().end);
    if (submitted_.front().keyframe) {
      durable_time_us_ = submitted_.front().time_us;
      ++stats_.keyframes_durable;
    }
    if (submitted_.front().session_end) ended_ = submitted_.size() == 1;
    submitted_.pop_front();
  }
  const bool all_known =
      std::all_of(submitted_.begin(), submitted_.end(), [](const Submitted& s) { return s.outcome.has_value(); });
  if (!submitted_.empty() && all_known) roll_back();
  prune_judged();
}

// The journal did not take the submitted records. They are forgotten, and the robot is asked for them again.
void SessionIntake::roll_back() {
  blocked_ = *submitted_.front().outcome;
  // A record that became durable after one that failed would be out of order in the map for good.
  broken_ = std::any_of(submitted_.begin(), submitted_.end(), [](const Submitted& s) { return s.outcome->ok(); });
  while (!submitted_.empty()) {  // the robot has been told that those from before begin() are settled, so they are kept
    if (auto& before = submitted_.back().before_begin) {
      if (const auto* refusal = std::get_if<storage::RefusalRecord>(&*before))
        ++stats_.refused_before_begin[index_of(refusal->reason)];
      before_begin_.push_front(*before);
    }
    submitted_.pop_back();
  }
  turn_ = durable_;
  turn_time_us_ = durable_time_us_;
  judged_.erase(judged_.lower_bound(static_cast<std::uint32_t>(durable_)), judged_.end());
  while (!refused_.empty() && refused_.back().sequence >= durable_) refused_.pop_back();
  held_.clear();
  waiting_bytes_ = 0;
  given_up_.clear();
}

void SessionIntake::prune_judged() {
  if (judged_.size() <= kKeepJudged || !number_) return;
  const auto now = session();
  if (!now) return;
  const auto end = judged_.lower_bound(now->next_sequence);
  for (auto it = judged_.begin(); it != end && judged_.size() > kKeepJudged / 2;) it = judged_.erase(it);
}

void SessionIntake::drop_last_waiting() {
  for (auto it = held_.rbegin(); it != held_.rend(); ++it) {
    if (it->second.payload.empty()) continue;
    waiting_bytes_ -= it->second.payload.size();
    held_.erase(std::next(it).base());
    return;
  }
}

void SessionIntake::let_go() {
  held_.clear();
  waiting_bytes_ = 0;
  given_up_.clear();
  if (!number_) {
    before_begin_.clear();
    turn_ = durable_ = 0;
  }
  seen_ = turn_;
}

bool SessionIntake::idle() {
  return held_.empty() && given_up_.empty() && (number_ || before_begin_.empty()) && is_let_go_idle();
}

bool SessionIntake::is_let_go_idle() {
  if (beginning_ || !submitted_.empty()) return false;
  if (!number_) return true;
  const auto now = session();
  return now && now->next_sequence == durable_;
}

Acknowledgement SessionIntake::acknowledgement(const Reassembly& reassembly) const {
  Acknowledgement ack;
  ack.session = uuid_;
  ack.next_sequence = durable_;
  ack.number = number();
  ack.incomplete = reassembly.missing(uuid_);
  add_ranges(ack, reassembly.incomplete(uuid_));
  for (const auto* list : {&refused_, &conflicts_})
    for (const Refused& r : *list)
      if (list == &conflicts_ || r.sequence < durable_) ack.refused.push_back(r);
  // Included even if nothing came: a robot that returns may have nothing left to send.
  if (const Status session = judge_session(); !session.ok())
    ack.refused.push_back({kWholeSession, 0, session.reason()});
  if (ack.refused.size() > kMaxAckRefused) ack.refused.erase(ack.refused.begin(), ack.refused.end() - kMaxAckRefused);
  std::sort(ack.refused.begin(), ack.refused.end(),
            [](const Refused& a, const Refused& b) { return a.sequence < b.sequence; });
  return ack;
}

void SessionIntake::add_ranges(Acknowledgement& ack, const std::vector<std::uint32_t>& incomplete) const {
  std::vector<SequenceRange> held;
  if (turn_ > durable_) held.push_back({static_cast<std::uint32_t>(durable_), static_cast<std::uint32_t>(turn_ - 1)});
  for (const auto& [sequence, keyframe] : held_) held.push_back({sequence, sequence});
  for (const auto& [from, gap] : given_up_) held.push_back({from, gap.to});
  std::vector<SequenceRange> known = held;
  for (const std::uint32_t s : incomplete)
    if (s >= turn_) known.push_back({s, s});

  const auto merge = [](std::vector<SequenceRange>& ranges) {
    std::sort(ranges.begin(), ranges.end(), [](const auto& a, const auto& b) { return a.from < b.from; });
    std::vector<SequenceRange> merged;
    for (const SequenceRange& r : ranges) {
      if (!merged.empty() && r.from <= std::uint64_t{merged.back().to} + 1)
        merged.back().to = std::max(merged.back().to, r.to);
      else
        merged.push_back(r);
    }
    ranges = std::move(merged);
  };
  merge(held);
  merge(known);

  std::uint64_t next = durable_;
  for (const SequenceRange& r : known) {
    if (r.from > next) ack.missing.push_back({static_cast<std::uint32_t>(next), r.from - 1});
    next = std::max(next, std::uint64_t{r.to} + 1);
  }
  if (next < seen_) ack.missing.push_back({static_cast<std::uint32_t>(next), static_cast<std::uint32_t>(seen_ - 1)});
  if (held.size() > kMaxAckRanges) held.resize(kMaxAckRanges);
  if (ack.missing.size() > kMaxAckRanges) ack.missing.resize(kMaxAckRanges);
  ack.held = std::move(held);
}

}  // namespace relmap::intake
