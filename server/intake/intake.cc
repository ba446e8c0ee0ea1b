#include "server/intake/intake.h"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/crc32c.h"

namespace relmap {

namespace {
constexpr std::chrono::milliseconds kQueueFull{20};  // until the sink is asked again
constexpr std::chrono::milliseconds kSinkFails{200};
constexpr std::chrono::milliseconds kIdle{1000};
}  // namespace

Intake::Intake(KeyframeSink& sink, Budget& budget, const BootId& boot, IntakeOptions options,
               std::function<void()> wake)
    : sink_(sink),
      budget_(budget),
      boot_(boot),
      options_(options),
      outcomes_(std::make_shared<Outcomes>()),
      reassembly_(budget) {
  outcomes_->wake = std::move(wake);
}

Intake::~Intake() {
  const std::lock_guard lock(outcomes_->mutex);
  outcomes_->wake = nullptr;
}

Intake::Entry* Intake::open(const SessionUuid& session, SteadyTime now) {
  auto it = sessions_.find(session);
  if (it == sessions_.end()) {
    if (sessions_.size() >= options_.max_sessions && !make_room()) return nullptr;
    auto submit = [this, session, outcomes = outcomes_](JournalRecord record, std::uint64_t ticket) {
      return sink_.submit(std::move(record), [outcomes, session, ticket](const Result<std::uint64_t>& result) {
        const std::lock_guard lock(outcomes->mutex);
        outcomes->list.push_back({session, ticket, result.status()});
        if (outcomes->wake) outcomes->wake();
      });
    };
    it = sessions_
             .emplace(session, Entry{SessionIntake(session, sink_, std::move(submit), stats_),
                                     AcknowledgementSchedule(options_.times)})
             .first;
    it->second.schedule.news();  // the robot learns where the daemon stands
  }
  it->second.schedule.heard(now);
  return &it->second;
}

bool Intake::make_room() {
  auto oldest = sessions_.end();
  for (auto it = sessions_.begin(); it != sessions_.end(); ++it) {
    if (oldest != sessions_.end() && it->second.schedule.last_heard() >= oldest->second.schedule.last_heard()) continue;
    if (!it->second.intake.begun() || it->second.intake.idle()) oldest = it;
  }
  if (oldest == sessions_.end()) return false;
  reassembly_.forget(oldest->first, UINT64_MAX);
  sessions_.erase(oldest);
  return true;
}

// A robot that is gone must not keep the share of those that are there. What it had sent and nobody was told to be
// durable is as if it had never come; should it come back, it will be asked for it.
void Intake::forget_silent(SteadyTime now) {
  for (auto it = sessions_.begin(); it != sessions_.end();) {
    auto& [session, entry] = *it;
    const bool silent = entry.schedule.last_heard() + options_.patience <= now;
    if (silent) {
      entry.intake.let_go();
      reassembly_.forget(session, UINT64_MAX);
    }
    it = silent && entry.intake.idle() ? sessions_.erase(it) : std::next(it);
  }
}

bool Intake::wanted(Entry& entry, std::uint32_t sequence, std::uint32_t crc) {
  switch (entry.intake.classify(sequence, crc)) {
    case SessionIntake::Verdict::kTake:
      return true;
    case SessionIntake::Verdict::kRepeat:
      ++stats_.repeated_parts;
      break;
    case SessionIntake::Verdict::kConflict:
      entry.intake.note_conflict(sequence, crc);
      count_part(Reason::SEQUENCE_CONFLICT);
      break;
    case SessionIntake::Verdict::kSettled:
      count_part(Reason::SEQUENCE_SETTLED);
      break;
    case SessionIntake::Verdict::kTooFar:
      count_part(Reason::SEQUENCE_TOO_FAR);
      break;
  }
  entry.schedule.news();  // the robot does not know, or it would not have sent this
  return false;
}

void Intake::take_part(const KeyframePart& part, SteadyTime now) try {
  ++stats_.parts;
  if (const Status s = check_part(part); !s.ok()) return count_part(s.reason());
  Entry* entry = open(part.session, now);
  if (!entry) return count_part(Reason::BUDGET_EXCEEDED);
  if (!wanted(*entry, part.sequence, part.payload_crc)) return;
  entry->intake.seen(part.sequence);
  Result<std::optional<Reassembly::Payload>> whole = reassembly_.add(part);
  if (!whole.ok()) return count_part(whole.reason());
  if (whole->has_value()) take_whole(*entry, part.session, part.sequence, std::move(**whole));
} catch (const StatusError& error) {
  count_part(error.status().reason());
}

void Intake::take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload,
                          SteadyTime now) try {
  ++stats_.parts;
  if (payload.empty() || payload.size() > kMaxKeyframeBytes) return count_part(Reason::BAD_SIZE);
  if (crc32c(payload) != crc) return count_part(Reason::CORRUPT);
  Entry* entry = open(session, now);
  if (!entry) return count_part(Reason::BUDGET_EXCEEDED);
  if (!wanted(*entry, sequence, crc)) return;
  auto charge = ReassemblyCharge::take(budget_, payload.size());
  if (!charge) return count_part(Reason::BUDGET_EXCEEDED);
  take_whole(*entry, session, sequence, {crc, std::move(payload), std::move(charge)});
} catch (const StatusError& error) {
  count_part(error.status().reason());
}

void Intake::take_whole(Entry& entry, const SessionUuid& session, std::uint32_t sequence, Reassembly::Payload payload) {
  ++stats_.keyframes_received;
  entry.payload_bytes += 0.1 * (static_cast<double>(payload.bytes.size()) - entry.payload_bytes);
  if (!entry.intake.take(sequence, std::move(payload)).ok()) entry.schedule.news();
  advance(session, entry);
}

void Intake::take_gap(const Gap& gap, SteadyTime now) try {
  const auto refuse = [this](Reason reason) { ++stats_.messages_refused[index_of(reason)]; };
  if (gap.from > gap.to || gap.session.is_nil() ||
      (gap.reason != Reason::DROPPED_BY_ROBOT && gap.reason != Reason::CAPTURE_FAILED))
    return refuse(Reason::INVALID_ARGUMENT);
  if (gap.to - gap.from >= kMaxGapSequences) return refuse(Reason::BAD_SIZE);
  if (gap.to > kMaxSequence) return refuse(Reason::INVALID_ARGUMENT);
  Entry* entry = open(gap.session, now);
  if (!entry) return refuse(Reason::BUDGET_EXCEEDED);
  entry->schedule.news();
  entry->intake.give_up(gap.from, gap.to, gap.reason);
  advance(gap.session, *entry);
} catch (const StatusError& error) {
  ++stats_.messages_refused[index_of(error.status().reason())];
}

void Intake::count_foreign(Reason reason) { ++stats_.messages_refused[index_of(reason)]; }

void Intake::advance(const SessionUuid& session, Entry& entry) {
  take_outcomes();  // what failed first is to be submitted first
  entry.intake.advance();
  reassembly_.forget(session, entry.intake.turn());
}

void Intake::take_outcomes() {
  std::vector<Outcomes::Outcome> outcomes;
  {
    const std::lock_guard lock(outcomes_->mutex);
    outcomes.swap(outcomes_->list);
  }
  for (const Outcomes::Outcome& outcome : outcomes) {
    const auto it = sessions_.find(outcome.session);
    if (it == sessions_.end()) continue;
    it->second.intake.settle(outcome.ticket, outcome.status);
    it->second.schedule.news();
  }
}

std::vector<Acknowledgement> Intake::poll(SteadyTime now) {
  take_outcomes();
  forget_silent(now);
  std::vector<Acknowledgement> due;
  for (auto& [session, entry] : sessions_) {
    if (!entry.intake.blocked().ok()) advance(session, entry);
    if (entry.schedule.due(imperfect(session, entry)) > now) continue;
    entry.schedule.sent(now);
    due.push_back(make_acknowledgement(session, entry));
  }
  stats_.acknowledgements += due.size();
  return due;
}

SteadyTime Intake::next_due(SteadyTime now) const {
  SteadyTime next = now + kIdle;
  for (const auto& [session, entry] : sessions_) {
    next = std::min(next, entry.schedule.due(imperfect(session, entry)));
    const Reason blocked = entry.intake.blocked().reason();
    if (blocked != Reason::OK)
      next = std::min(next, now + (blocked == Reason::BUDGET_EXCEEDED ? kQueueFull : kSinkFails));
  }
  return next;
}

bool Intake::imperfect(const SessionUuid& session, const Entry& entry) const {
  return entry.intake.has_missing() || reassembly_.has_incomplete(session);
}

// What is there already, and as much more as there is room for, shared among the sessions. Never less than one, or
// nothing would ever be asked for again.
std::uint32_t Intake::credits(const SessionUuid& session, const Entry& entry) const {
  const Status& blocked = entry.intake.blocked();
  if (!blocked.ok() && blocked.reason() != Reason::BUDGET_EXCEEDED) return 0;
  const std::size_t reserved = budget_.used(Share::kReassembly);
  const std::size_t allowed = budget_.allowance(Share::kReassembly);
  const std::size_t room = std::min(sink_.free_bytes(), allowed - std::min(allowed, reserved));
  const double more = static_cast<double>(room) / static_cast<double>(sessions_.size()) / entry.payload_bytes;
  const std::size_t there = entry.intake.pending() + reassembly_.incomplete(session).size();
  return static_cast<std::uint32_t>(
      std::clamp(static_cast<double>(there) + std::min<double>(more, kIntakeWindow), 1.0, double{kIntakeWindow}));
}

Acknowledgement Intake::make_acknowledgement(const SessionUuid& session, const Entry& entry) const {
  Acknowledgement ack = entry.intake.acknowledgement(reassembly_);
  ack.boot = boot_;
  ack.credits = credits(session, entry);
  return ack;
}

Result<Acknowledgement> Intake::acknowledgement(const SessionUuid& session) try {
  if (const auto it = sessions_.find(session); it != sessions_.end()) return make_acknowledgement(session, it->second);
  for (const Session& known : sink_.view()->sessions()) {
    if (known.header.uuid != session) continue;
    const Entry* const entry = open(session, SteadyTime{});
    if (!entry) return {Reason::BUDGET_EXCEEDED, "too many sessions are being taken in"};
    return make_acknowledgement(session, *entry);
  }
  return {Reason::NO_SUCH_SESSION, "no session " + session.to_string()};
} catch (const StatusError& error) {
  return error.status();
}

IngestStats Intake::stats() const {
  IngestStats stats = stats_;
  stats.evicted = reassembly_.evicted();
  stats.sessions = sessions_.size();
  for (const auto& [session, entry] : sessions_) {
    stats.pending += entry.intake.pending();
    if (stats.blocked.ok()) stats.blocked = entry.intake.blocked();
  }
  return stats;
}

}  // namespace relmap
