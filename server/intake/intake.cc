#include "server/intake/intake.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/crc32c.h"
#include "proto/base/mutex.h"
#include "proto/base/names.h"

namespace relmap::intake {

namespace {
constexpr std::chrono::milliseconds kQueueFull{20};   // retry interval while the sink's queue is full
constexpr std::chrono::milliseconds kSinkFails{200};  // retry interval while the sink fails otherwise
constexpr std::chrono::milliseconds kIdle{1000};
constexpr std::chrono::seconds kHeldBack{1};         // a robot is told to slow down after being held back so long
constexpr std::chrono::seconds kToldAgain{5};        // the message is repeated, since it may have been lost
constexpr double kNearLimit = 0.2;                   // seconds' worth of keyframes
constexpr std::chrono::milliseconds kStranger{500};  // a session that has not begun is answered so long after a message
constexpr double kSlowest = 0.1;                     // keyframes per second: the lowest rate that a robot is told
constexpr std::chrono::seconds kLive{5};             // a robot heard within this time is present
constexpr std::chrono::minutes kLately{1};           // stats() counts the sessions that were heard within this time
constexpr std::chrono::seconds kLookForNames{1};     // interval of looking for robots of the same name
constexpr std::size_t kMaxKnown = 64;            // sessions of which is known what the map has, before they are opened
constexpr std::int64_t kNoLag = 86'400'000'000;  // us: so old a time stamp is a recording's and tells no lag

// Counts why a message was not taken. Only NOT_ALLOWED is its sender's to know; the others pass.
Status count_not_opened(ReasonCounts& counts, const Status& why) {
  ++counts[index_of(why.reason())];
  return why.reason() == Reason::NOT_ALLOWED ? why : Status();
}

}  // namespace

Intake::Intake(KeyframeSink& sink, storage::Budget& budget, const BootId& boot, IntakeOptions options,
               std::function<void()> wake)
    : sink_(sink),
      budget_(budget),
      boot_(boot),
      options_(options),
      outcomes_(std::make_shared<Outcomes>()),
      reassembly_(budget, [this](std::size_t more_than) { return drop_waiting(more_than); }) {
  outcomes_->wake = std::move(wake);
}

Intake::~Intake() {
  const MutexLock lock(outcomes_->mutex);
  outcomes_->wake = nullptr;
}

// Whether the sender may send for the session. What has not begun is of the robot that first proved to send for it.
Status Intake::check_sender(const SessionUuid& session, const Entry& entry, const Sender& sender) const {
  if (entry.intake.has_begun()) return may_send(sender, session, owner_of(entry));
  const bool proved = entry.sender && !entry.sender->robot.empty();
  return proved ? may_send(sender, session, {entry.sender->robot, true}) : Status();
}

Owner Intake::owner_of(const std::string& robot) const { return {robot, options_.proving.contains(robot)}; }
Owner Intake::owner_of(const Entry& entry) const { return owner_of(entry.intake.header().robot); }

std::string Intake::robot_of(const SessionUuid& session) const {
  const auto at = sessions_.find(session);
  if (at == sessions_.end()) {
    const auto silent = silent_.find(session);
    return silent == silent_.end() ? std::string() : silent->second.stats.robot;
  }
  const Entry& entry = at->second;
  if (entry.intake.has_begun()) return entry.intake.header().robot;
  return entry.sender ? entry.sender->robot : std::string();
}

Party Intake::party(const SessionUuid& session, const Sender& sender) const {
  const auto entry = sessions_.find(session);
  if (entry == sessions_.end() || !entry->second.intake.has_begun()) return party_of(session, sender, nullptr);
  const Owner owner = owner_of(entry->second);
  return party_of(session, sender, &owner);
}

std::optional<MapQuestion> Intake::question(const SessionUuid& session, std::optional<std::uint32_t> sequence,
                                            const Sender& sender) const {
  if (const auto entry = sessions_.find(session); entry != sessions_.end()) {
    const SessionIntake& intake = entry->second.intake;
    if (!sequence || intake.knows(*sequence) || !check_sender(session, entry->second, sender).ok()) return std::nullopt;
    return MapQuestion{session, intake.number(), sequence};
  }
  const auto at = known_.find(session);
  if (at == known_.end()) {
    const auto number = sink_.find_session(session);
    return number ? std::optional(MapQuestion{session, *number, std::nullopt}) : std::nullopt;
  }
  const auto& [failed, known, judged] = at->second;
  if (failed.ok() && !may_send(sender, session, owner_of(known.session->header.robot)).ok()) return std::nullopt;
  if (!failed.ok() || !sequence || *sequence >= known.session->next_sequence || judged.contains(*sequence))
    return std::nullopt;
  return MapQuestion{session, known.session->number, sequence};
}

// Of a sequence that cannot be read is known only that it is settled.
void Intake::know(const MapQuestion& question, MapAnswer answer) {
  const Judged judged = answer.failed.ok() ? answer.judged : Judged{0, answer.failed.reason(), true};
  if (const auto entry = sessions_.find(question.uuid); entry != sessions_.end()) {
    if (question.sequence) entry->second.intake.know(*question.sequence, judged);
    return;
  }
  auto known = known_.find(question.uuid);
  if (question.sequence) {
    // If the session has been taken in and let go of meanwhile, it is asked for again.
    if (known != known_.end()) known->second.judged.emplace(*question.sequence, judged);
    return;
  }
  if (known == known_.end()) {
    if (known_.size() >= kMaxKnown) known_.erase(known_.begin());
    known = known_.try_emplace(question.uuid).first;
  }
  known->second.failed = answer.failed;
  known->second.session = std::move(answer.session);
}

// What the map knows of a session that is not taken in; null: it has none such. Stays there until it is taken in.
Result<Intake::Known*> Intake::known(const SessionUuid& session) {
  if (const auto unread = question(session, std::nullopt)) know(*unread, answer(sink_, *unread));
  const auto at = known_.find(session);
  if (at == known_.end()) return nullptr;
  if (!at->second.failed.ok()) return known_.extract(at).mapped().failed;
  // It may have changed since it was read. It is held in memory, so that it is there at once.
  std::optional<storage::Session>& record = at->second.session.session;
  if (auto present = sink_.view()->session(record->number)) record = std::move(present);
  return &at->second;
}

// The session's entry, which is made if it is not there. BUDGET_EXCEEDED: there are too many. NOT_ALLOWED.
Result<Intake::Entry*> Intake::open(const SessionUuid& session, SteadyTime now, const Sender& sender) {
  auto it = sessions_.find(session);
  // What anyone has sent must not stand in the way of the robot itself.
  if (it != sessions_.end() && !it->second.intake.has_begun() && it->second.sender && it->second.sender->anyone &&
      !sender.anyone) {
    // What begins would be taken for the beginning of what the robot sends.
    if (it->second.intake.begins()) return Status(Reason::BUDGET_EXCEEDED, "the session is beginning");
    forget(it);
    it = sessions_.end();
  }
  const bool fresh = it == sessions_.end();
  if (fresh) {
    const auto known = this->known(session);
    if (!known.ok()) return known.status();
    // Nobody else has it opened: what is opened and is not known to have begun would be his.
    if (*known)
      if (Status may = may_send(sender, session, owner_of((*known)->session.session->header.robot)); !may.ok())
        return may;
    const Party newcomer = party(session, sender);
    if (sessions_.size() >= places_for(newcomer) && !make_room(newcomer, now))
      return Status(Reason::BUDGET_EXCEEDED, "as many sessions as can be are being taken in");
    auto submit = [this, session, outcomes = outcomes_](storage::JournalRecord record, std::uint64_t ticket) {
      return sink_.submit(std::move(record), [outcomes, session, ticket](const Result<std::uint64_t>& result) {
        const MutexLock lock(outcomes->mutex);
        outcomes->list.push_back({session, ticket, result.status()});
        if (outcomes->wake) outcomes->wake();
      });
    };
    auto begin = [this, session, outcomes = outcomes_](const SessionHeader& header) {
      sink_.begin_session(header, [outcomes, session](const Result<SessionNumber>& number) {
        const MutexLock lock(outcomes->mutex);
        outcomes->begun.emplace_back(session, number);
        if (outcomes->wake) outcomes->wake();
      });
    };
    const Known from = *known ? known_.extract(session).mapped() : Known();
    it = sessions_
             .emplace(session, Entry{SessionIntake(session, sink_, from.session, std::move(submit), std::move(begin),
                                                   stats_, options_.robots, options_.proving),
                                     AcknowledgementSchedule(options_.times)})
             .first;
    ++places_[it->second.party];
    for (const auto& [sequence, judged] : from.judged) it->second.intake.know(sequence, judged);
    it->second.schedule.news();  // tells the robot what the daemon has
    it->second.heard_first = now;
  }
  Entry& entry = it->second;
  if (Status may = check_sender(session, entry, sender); !may.ok()) return may;
  if (fresh) {
    silent_.erase(session);
    ++begun_version_;
  }
  if (!entry.sender || (entry.sender->robot.empty() && !sender.robot.empty())) entry.sender = sender;
  if (entry.party.robot.empty()) count(entry, party(session, sender));
  entry.schedule.heard(now);
  return &entry;
}

// Counts the entry's place as this party's.
void Intake::count(Entry& entry, const Party& party) {
  if (party == entry.party) return;
  ++places_[party];
  if (const auto former = places_.find(entry.party); --former->second == 0) places_.erase(former);
  entry.party = party;
}

Intake::Sessions::iterator Intake::erase(Sessions::iterator at) {
  if (const auto place = places_.find(at->second.party); --place->second == 0) places_.erase(place);
  return sessions_.erase(at);
}

void Intake::forget(Sessions::iterator at) {
  reassembly_.forget(at->first, UINT64_MAX);
  leave_line(at->first);
  erase(at);
  ++begun_version_;
}

// A party that has a quarter of the places takes none of the last quarter, so that one is free for others even while
// nothing can be let go of all that it has under way.
std::size_t Intake::places_for(const Party& newcomer) const {
  const std::size_t quarter = options_.max_sessions / 4;
  return options_.max_sessions - (places_of(newcomer) >= quarter ? quarter : 0);
}

std::size_t Intake::places_of(const Party& party) const {
  const auto places = places_.find(party);
  return places == places_.end() ? 0 : places->second;
}

bool Intake::make_room(const Party& newcomer, SteadyTime now) {
  const auto longest_silent = [this](auto may_go) {
    auto oldest = sessions_.end();
    for (auto it = sessions_.begin(); it != sessions_.end(); ++it)
      if ((oldest == sessions_.end() || it->second.schedule.last_heard() < oldest->second.schedule.last_heard()) &&
          may_go(it->second))
        oldest = it;
    return oldest;
  };
  // Whoever sends much must not make room for himself where another's robot has announced what it will send.
  auto goes = longest_silent([&](Entry& entry) {
    if (entry.intake.has_begun()) return entry.intake.idle();
    return !entry.intake.begins() && (entry.party == Party{} || places_of(entry.party) >= places_of(newcomer));
  });
  if (goes == sessions_.end()) {
    const auto most = std::max_element(places_.begin(), places_.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most->second <= places_of(newcomer) + 1) return false;
    goes = longest_silent([&](Entry& entry) { return entry.party == most->first && entry.intake.is_let_go_idle(); });
    if (goes == sessions_.end()) return false;
  }
  remember(goes->first, goes->second, now);
  forget(goes);
  return true;
}

bool Intake::drop_waiting(std::size_t more_than) {
  struct Waiting {
    std::size_t bytes = 0;
    SessionIntake* largest = nullptr;
  };
  std::map<Party, Waiting> waiting;
  for (auto& [session, entry] : sessions_) {
    const std::size_t bytes = entry.intake.waiting_bytes();
    if (bytes == 0) continue;
    Waiting& all = waiting[entry.party];
    all.bytes += bytes;
    if (!all.largest || bytes > all.largest->waiting_bytes()) all.largest = &entry.intake;
  }
  const auto most = std::max_element(waiting.begin(), waiting.end(),
                                     [](const auto& a, const auto& b) { return a.second.bytes < b.second.bytes; });
  if (most == waiting.end() || most->second.bytes <= more_than) return false;
  most->second.largest->drop_last_waiting();
  return true;
}

// A robot that is gone must not hold memory that others need. What it sent and was not told to be durable is dropped;
// if it comes back, it is asked for that again.
void Intake::forget_silent(SteadyTime now) {
  for (auto it = sessions_.begin(); it != sessions_.end();) {
    auto& [session, entry] = *it;
    const bool silent = entry.schedule.last_heard() + options_.patience <= now;
    if (silent) {
      entry.intake.let_go();
      reassembly_.forget(session, UINT64_MAX);
    }
    const bool gone = silent && entry.intake.idle() && entry.claimed + options_.patience <= now;
    begun_version_ += gone;
    if (gone) {
      remember(session, entry, now);
      leave_line(session);
    }
    it = gone ? erase(it) : std::next(it);
  }
  std::erase_if(allowances_, [&](const auto& item) { return item.second.at + std::chrono::minutes(1) <= now; });
  std::erase_if(silent_, [&](const auto& item) { return item.second.heard + options_.remember <= now; });
}

// Keeps a silent robot in the list of robots, where an operator looks for it. Sessions that have not begun are not
// kept: they may be garbage.
void Intake::remember(const SessionUuid& session, Entry& entry, SteadyTime now) {
  if (!entry.intake.has_begun() || entry.intake.ended()) return;
  if (silent_.size() >= options_.max_sessions)
    silent_.erase(std::min_element(silent_.begin(), silent_.end(),
                                   [](const auto& a, const auto& b) { return a.second.heard < b.second.heard; }));
  RobotStats stats = stats_of(session, entry, now);
  stats.silent = true;
  stats.keyframes_per_s = stats.bytes_per_s = 0;
  stats.credits = 0;
  silent_.insert_or_assign(session, Silent{std::move(stats), entry.schedule.last_heard()});
  if (entry.announced) note(RobotEvent::Kind::kSilent, session, entry, now);
}

void Intake::note(RobotEvent::Kind kind, const SessionUuid& session, const Entry& entry, SteadyTime now) {
  RobotEvent& event = events_.emplace_back();
  event.kind = kind;
  event.uuid = session;
  event.session = entry.intake.number();
  event.robot = entry.intake.header().robot;
  event.name = entry.intake.header().name;
  event.next_sequence = entry.intake.next_sequence();
  event.silent = std::chrono::duration_cast<std::chrono::seconds>(now - entry.schedule.last_heard());
}

// Finds robots of one name that send different sessions at the same time: each is heard after the other was first
// heard. A front-end that was restarted with a new session is not meant, because its former session is heard no more.
Intake::Namesakes Intake::namesakes(SteadyTime now) const {
  using Live = std::pair<const SessionUuid, Entry>;
  std::map<std::string_view, std::vector<const Live*>> by_name;
  for (const Live& item : sessions_) {
    const Entry& entry = item.second;
    if (entry.intake.header().robot == kUsualRobot) continue;
    if (entry.intake.has_begun() && !entry.intake.ended() && now - entry.schedule.last_heard() <= kLive)
      by_name[entry.intake.header().robot].push_back(&item);
  }
  Namesakes found;
  for (const auto& [name, live] : by_name)
    for (const Live* one : live)
      for (const Live* other : live)
        if (one != other && one->second.schedule.last_heard() > other->second.heard_first &&
            other->second.schedule.last_heard() > one->second.heard_first)
          found[one->first].push_back(other->first);
  return found;
}

void Intake::tell_of_namesakes(SteadyTime now) {
  if (now - looked_for_namesakes_ < kLookForNames) return;
  looked_for_namesakes_ = now;
  for (const auto& [session, others] : namesakes(now)) {
    Entry& entry = sessions_.find(session)->second;
    if (!std::exchange(entry.namesake_told, true)) note(RobotEvent::Kind::kSameName, session, entry, now);
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
      entry.intake.note_conflict(sequence, crc, Reason::SEQUENCE_CONFLICT);
      count_part(entry, Reason::SEQUENCE_CONFLICT);
      break;
    case SessionIntake::Verdict::kDeleted:
      entry.intake.note_conflict(sequence, crc, Reason::SESSION_DELETED);
      count_part(entry, Reason::SESSION_DELETED);
      break;
    case SessionIntake::Verdict::kSettled:
      count_part(entry, Reason::SEQUENCE_SETTLED);
      break;
    case SessionIntake::Verdict::kTooFar:
      count_part(entry, Reason::SEQUENCE_TOO_FAR);
      break;
  }
  entry.schedule.news();  // the robot would not have sent this if it knew
  return false;
}

void Intake::take_part(const KeyframePart& part, SteadyTime now, const Sender& sender) try {
  ++stats_.parts;
  if (const Status s = check_part(part); !s.ok()) return count_part(s.reason());
  const auto opened = open(part.session, now, sender);
  if (!opened.ok()) return count_part(opened.reason());
  Entry* const entry = *opened;
  entry->by_parts = true;
  entry->bytes.add(now, static_cast<double>(part.data.size()));
  if (!wanted(*entry, part.sequence, part.payload_crc) || !paced(*entry, part.sequence, now)) return;
  entry->intake.seen(part.sequence);
  auto whole = reassembly_.add(part, entry->party);
  if (!whole.ok()) return count_part(*entry, whole.reason());
  if (whole->has_value()) take_whole(*entry, part.session, part.sequence, std::move(**whole), now, sender);
} catch (const StatusError& error) {
  count_part(error.status().reason());
}

Status Intake::take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload,
                            SteadyTime now, const Sender& sender) try {
  ++stats_.parts;
  const auto refuse = [this](Reason reason) {
    count_part(reason);
    return Status();
  };
  if (payload.empty() || payload.size() > kMaxKeyframeBytes) return refuse(Reason::BAD_SIZE);
  if (crc32c(payload) != crc) return refuse(Reason::CORRUPT);
  const auto opened = open(session, now, sender);
  if (!opened.ok()) return count_not_opened(stats_.parts_refused, opened.status());
  Entry& entry = **opened;
  entry.by_parts = false;
  entry.bytes.add(now, static_cast<double>(payload.size()));
  if (!wanted(entry, sequence, crc)) return {};
  if (auto charge = reassembly_.take_room(payload.size()))
    take_whole(entry, session, sequence, {crc, std::move(payload), std::move(charge)}, now, sender);
  else
    count_part(entry, Reason::BUDGET_EXCEEDED);
  return {};
} catch (const StatusError& error) {
  count_part(error.status().reason());
  return {};
}

void Intake::take_whole(Entry& entry, const SessionUuid& session, std::uint32_t sequence, Reassembly::Payload payload,
                        SteadyTime now, const Sender& sender) {
  ++stats_.keyframes_received;
  if (!may_begin(entry, sender, now)) return count_part(entry, Reason::RATE_LIMITED);
  entry.payload_bytes += 0.1 * (static_cast<double>(payload.bytes.size()) - entry.payload_bytes);
  const bool sound = entry.intake.take(sequence, std::move(payload), sender).ok();
  if (!sound) entry.schedule.news();
  advance(session, entry, now);
  if (sound && entry.intake.has_begun() && !std::exchange(entry.announced, true))
    note(RobotEvent::Kind::kHeard, session, entry, now);
}

Status Intake::take_gap(const Gap& gap, SteadyTime now, const Sender& sender) try {
  const auto refuse = [this](Reason reason) {
    count_foreign(reason);
    return Status();
  };
  if (gap.from > gap.to || gap.session.is_nil() ||
      (gap.reason != Reason::DROPPED_BY_ROBOT && gap.reason != Reason::CAPTURE_FAILED &&
       gap.reason != Reason::MAP_RESTORED))
    return refuse(Reason::INVALID_ARGUMENT);
  if (gap.to - gap.from >= kMaxGapSequences) return refuse(Reason::BAD_SIZE);
  if (gap.to > kMaxSequence) return refuse(Reason::INVALID_ARGUMENT);
  const auto opened = open(gap.session, now, sender);
  if (!opened.ok()) return count_not_opened(stats_.messages_refused, opened.status());
  Entry& entry = **opened;
  entry.schedule.news();
  entry.intake.give_up(gap.from, gap.to, gap.reason);
  advance(gap.session, entry, now);
  return {};
} catch (const StatusError& error) {
  count_foreign(error.status().reason());
  return {};
}

Status Intake::take_end(const SessionEnd& end, SteadyTime now, const Sender& sender) try {
  if (end.session.is_nil()) {
    count_foreign(Reason::INVALID_ARGUMENT);
    return {};
  }
  const auto opened = open(end.session, now, sender);
  if (!opened.ok()) return count_not_opened(stats_.messages_refused, opened.status());
  Entry& entry = **opened;
  entry.schedule.news();
  entry.intake.end(end.next_sequence);
  if (entry.intake.ended()) tell(end.session, PoseNews::Kind::kEnded);
  return {};
} catch (const StatusError& error) {
  count_foreign(error.status().reason());
  return {};
}

Status Intake::claim(const SessionUuid& session, SteadyTime now, const Sender& sender) {
  if (session.is_nil()) return {Reason::INVALID_ARGUMENT, "the nil session"};
  const auto at = sessions_.find(session);
  const bool claimed = at == sessions_.end()
                           ? sink_.find_session(session).has_value()
                           : at->second.intake.has_begun() || (at->second.sender && !at->second.sender->robot.empty());
  Status may;
  if (!claimed) {
    may = open(session, now, sender).status();
  } else if (at != sessions_.end()) {  // it is not heard: anyone may send again what the robot announced long ago
    may = check_sender(session, at->second, sender);
    if (may.ok() && !at->second.intake.has_begun()) at->second.claimed = now;
  }
  return may.ok() ? may : count_not_opened(stats_.messages_refused, may);
}

void Intake::count_foreign(Reason reason) { ++stats_.messages_refused[index_of(reason)]; }

// Why nothing of the session is being journalled; OK if it is.
const Status& Intake::blocked(const Entry& entry) const { return entry.in_line ? no_room_ : entry.intake.blocked(); }

void Intake::advance(const SessionUuid& session, Entry& entry, SteadyTime now) {
  if (!entry.intake.has_begun())
    try_to_begin(session, entry, now);
  else if (entry.intake.has_next())
    join_line(session, entry);
  serve_line(now);
}

// What a session has before it begins needs no room in the sink: refusals are settled until then without a record.
void Intake::try_to_begin(const SessionUuid& session, Entry& entry, SteadyTime now) {
  if (now < entry.begin_again) return;
  while (entry.intake.submit_next()) {
  }
  reassembly_.forget(session, entry.intake.turn());
}

void Intake::join_line(const SessionUuid& session, Entry& entry) {
  if (!std::exchange(entry.in_line, true)) line_.push(entry.intake.header().robot, session);
}

void Intake::leave_line(const SessionUuid& session) { line_.erase(session); }

// Submits what the sessions in line have, one record of each in turn, until the sink has no more room.
void Intake::serve_line(SteadyTime now) {
  take_outcomes(now);  // records that failed must be submitted again before later ones
  while (!line_.empty()) {
    const SessionUuid session = line_.front();
    Entry& entry = sessions_.find(session)->second;
    const bool more = entry.intake.submit_next();
    reassembly_.forget(session, entry.intake.turn());
    if (entry.intake.blocked().reason() == Reason::BUDGET_EXCEEDED) {
      no_room_ = entry.intake.blocked();
      return;
    }
    (void)line_.pop();
    entry.in_line = false;
    if (more) join_line(session, entry);
  }
}

void Intake::take_outcomes(SteadyTime now) {
  std::vector<Outcomes::Outcome> outcomes;
  std::vector<std::pair<SessionUuid, Result<SessionNumber>>> begun;
  {
    const MutexLock lock(outcomes_->mutex);
    outcomes.swap(outcomes_->list);
    begun.swap(outcomes_->begun);
  }
  for (const auto& [session, number] : begun) {
    const auto it = sessions_.find(session);
    if (it == sessions_.end() || !it->second.intake.begins()) continue;  // it was forgotten meanwhile
    Entry& entry = it->second;
    entry.intake.begun(number);
    entry.schedule.news();
    if (!number.ok()) {
      entry.begin_again = now + (number.reason() == Reason::BUDGET_EXCEEDED ? kQueueFull : kSinkFails);
      continue;
    }
    ++begun_version_;
    if (entry.party.robot.empty()) count(entry, {session, {}});
    if (!std::exchange(entry.announced, true)) note(RobotEvent::Kind::kHeard, session, entry, now);
    join_line(session, entry);
  }
  for (const Outcomes::Outcome& outcome : outcomes) {
    const auto it = sessions_.find(outcome.session);
    if (it == sessions_.end()) continue;
    Entry& entry = it->second;
    const bool had_ended = entry.intake.ended();
    const auto newest = entry.intake.durable_time_us();
    entry.intake.settle(outcome.ticket, outcome.status);
    entry.schedule.news();
    if (entry.intake.ended() && !had_ended) tell(outcome.session, PoseNews::Kind::kEnded);
    if (const auto durable = entry.intake.durable_time_us(); durable && durable != newest) {
      entry.keyframes.add(now, 1);
      const std::int64_t lag = now_us() - *durable;
      entry.lag_us = lag >= 0 && lag < kNoLag ? lag : -1;
    }
  }
}

void Intake::tell(const SessionUuid& session, PoseNews::Kind kind, double rate_hz) {
  PoseNews news;
  news.session = session;
  news.kind = kind;
  news.keyframe.session = sessions_.find(session)->second.intake.number();
  news.rate_hz = rate_hz;
  news_.push_back(std::move(news));
}

std::vector<PoseNews> Intake::take_news() { return std::exchange(news_, {}); }

std::vector<RobotEvent> Intake::take_events() { return std::exchange(events_, {}); }

// Token bucket: what a session may send grows with time, up to a bound.
void Intake::replenish(Entry& entry, SteadyTime now) {
  const double rate = options_.max_keyframes_per_s;
  if (rate <= 0 || !entry.by_parts) return;
  const auto next = static_cast<double>(entry.intake.next_sequence());
  const double max_end = next + std::max<double>(kIntakeWindow, 2 * rate);
  if (entry.paced_at == SteadyTime{}) entry.paced_end = max_end;
  entry.paced_end += rate * std::chrono::duration<double>(now - std::max(entry.paced_at, now - kIdle)).count();
  entry.paced_at = now;
  entry.paced_end = std::clamp(entry.paced_end, next, max_end);
  if (entry.paced_end < next + kNearLimit * rate) entry.limited_at = now;
}

// Whether the session, if it has not begun, may do so. Sessions stay for good, so whoever begins them without end fills
// the map. Operators may.
bool Intake::may_begin(Entry& entry, const Sender& sender, SteadyTime now) {
  constexpr double kUnproved = 10;
  const bool limited = sender.anyone || !sender.robot.empty() || !sender.from.empty();
  if (options_.max_new_sessions_per_min <= 0 || entry.intake.has_begun() || entry.may_begin || !limited) return true;
  const double most = options_.max_new_sessions_per_min * (sender.robot.empty() ? kUnproved : 1);
  const auto [it, fresh] = allowances_.try_emplace({sender.robot, sender.from}, Allowance{most, now});
  Allowance& allowance = it->second;
  const double minutes = std::chrono::duration<double, std::ratio<60>>(now - allowance.at).count();
  allowance = {std::min(most, allowance.left + minutes * most), now};
  if (allowance.left < 1) return false;
  --allowance.left;
  return entry.may_begin = true;
}

bool Intake::paced(Entry& entry, std::uint32_t sequence, SteadyTime now) {
  replenish(entry, now);
  if (options_.max_keyframes_per_s <= 0 || sequence + 1.0 <= entry.paced_end) return true;
  entry.limited_at = now;
  count_part(entry, Reason::RATE_LIMITED);
  return false;
}

std::vector<Acknowledgement> Intake::poll(SteadyTime now) {
  take_outcomes(now);
  forget_silent(now);
  tell_of_namesakes(now);
  for (auto& [session, entry] : sessions_) {
    if (entry.intake.blocked().ok()) continue;
    if (entry.intake.has_begun())
      join_line(session, entry);
    else
      try_to_begin(session, entry, now);  // it cannot, for example since the map has as many as its memory allows
  }
  serve_line(now);
  std::vector<Acknowledgement> due;
  for (auto& [session, entry] : sessions_) {
    tell_pace(session, entry, now);
    const SteadyTime said = entry.schedule.due(imperfect(session, entry));
    if (said > now || (!entry.intake.has_begun() && said > entry.schedule.last_heard() + kStranger)) continue;
    entry.schedule.sent(now);
    due.push_back(make_acknowledgement(session, entry));
  }
  stats_.acknowledgements += due.size();
  return due;
}

// Tells a robot that sends more than is taken in to slow down, repeatedly while that lasts, and then to resume.
void Intake::tell_pace(const SessionUuid& session, Entry& entry, SteadyTime now) {
  replenish(entry, now);
  const bool limited = entry.limited_at != SteadyTime{} && now - entry.limited_at < kHeldBack;
  const bool full = blocked(entry).reason() == Reason::BUDGET_EXCEEDED;
  if (!limited && !full) {
    entry.held_back_since = {};
    if (entry.slowed_at == SteadyTime{} || now - entry.slowed_at < kToldAgain) return;
    entry.slowed_at = {};
    return tell(session, PoseNews::Kind::kResume);
  }
  if (entry.held_back_since == SteadyTime{}) entry.held_back_since = now;
  if (now - entry.held_back_since < kHeldBack) return;
  if (entry.slowed_at != SteadyTime{} && now - entry.slowed_at < kToldAgain) return;
  entry.slowed_at = now;
  tell(session, PoseNews::Kind::kSlowDown,
       limited ? options_.max_keyframes_per_s : std::max(kSlowest, entry.keyframes.per_second(now)));
}

SteadyTime Intake::next_due(SteadyTime now) const {
  SteadyTime next = now + kIdle;
  for (const auto& [session, entry] : sessions_) {
    const SteadyTime said = entry.schedule.due(imperfect(session, entry));
    if (entry.intake.has_begun() || said <= entry.schedule.last_heard() + kStranger) next = std::min(next, said);
    const Reason reason = blocked(entry).reason();
    if (reason != Reason::OK)
      next = std::min(next, now + (reason == Reason::BUDGET_EXCEEDED ? kQueueFull : kSinkFails));
  }
  return next;
}

// A session that has not begun is asked for missing parts only at the regular interval: it may be garbage, which must
// not be answered with floods.
bool Intake::imperfect(const SessionUuid& session, const Entry& entry) const {
  return entry.intake.has_begun() && (entry.intake.has_missing() || reassembly_.has_incomplete(session));
}

// The keyframes that have come already, and as many more as there is room for, shared among the parties. At least one
// unless the sink fails or the rate limit is reached; otherwise nothing would ever be sent again.
std::uint32_t Intake::credits(const SessionUuid& session, const Entry& entry) const {
  const Reason reason = blocked(entry).reason();
  if (reason != Reason::OK && reason != Reason::BUDGET_EXCEEDED) return 0;
  const std::size_t reserved = budget_.used(storage::Share::kReassembly);
  const std::size_t allowed = budget_.allowance(storage::Share::kReassembly);
  const std::size_t room = std::min(sink_.free_bytes(), allowed - std::min(allowed, reserved));
  const auto shares = static_cast<double>(places_.size()) * static_cast<double>(places_.at(entry.party));
  const double more = static_cast<double>(room) / shares / entry.payload_bytes;
  const std::size_t there = entry.intake.pending() + reassembly_.incomplete(session).size();
  double credits =
      std::clamp(static_cast<double>(there) + std::min<double>(more, kIntakeWindow), 1.0, double{kIntakeWindow});
  if (entry.by_parts && options_.max_keyframes_per_s > 0)
    credits = std::min(credits, std::max(0.0, entry.paced_end - static_cast<double>(entry.intake.next_sequence())));
  return static_cast<std::uint32_t>(credits);
}

Acknowledgement Intake::make_acknowledgement(const SessionUuid& session, const Entry& entry) const {
  Acknowledgement ack = entry.intake.acknowledgement(reassembly_);
  ack.boot = boot_;
  ack.credits = credits(session, entry);
  return ack;
}

Result<Acknowledgement> Intake::acknowledgement(const SessionUuid& session) try {
  if (const auto it = sessions_.find(session); it != sessions_.end()) return make_acknowledgement(session, it->second);
  if (const auto known = this->known(session); !known.ok())
    return known.status();
  else if (!*known)
    return {Reason::NO_SUCH_SESSION, "no session " + session.to_string()};
  const auto entry = open(session, SteadyTime{}, {});
  return entry.ok() ? make_acknowledgement(session, **entry) : Result<Acknowledgement>(entry.status());
} catch (const StatusError& error) {
  return error.status();
}

IngestStats Intake::stats(SteadyTime now) const {
  IngestStats stats = stats_;
  stats.evicted = reassembly_.evicted();
  stats.sessions = sessions_.size();
  for (const auto& [session, entry] : sessions_) {
    stats.heard += entry.schedule.last_heard() + kLately > now;
    stats.incomplete += reassembly_.incomplete(session).size();
    if (stats.blocked.ok()) stats.blocked = blocked(entry);
  }
  for (const auto& [session, silent] : silent_) stats.heard += silent.heard + kLately > now;
  return stats;
}

RobotStats Intake::stats_of(const SessionUuid& session, Entry& entry, SteadyTime now) {
  const Acknowledgement ack = make_acknowledgement(session, entry);
  RobotStats robot;
  robot.uuid = session;
  robot.session = entry.intake.number();
  robot.robot = entry.intake.header().robot;
  robot.name = entry.intake.header().name;
  if (robot.robot.empty()) {  // no keyframe of it was sound
    robot.robot = entry.sender && !entry.sender->robot.empty() ? entry.sender->robot : entry.intake.claimed_robot();
    robot.name = entry.intake.claimed_name();
  }
  robot.keyframes_per_s = entry.keyframes.per_second(now);
  robot.bytes_per_s = entry.bytes.per_second(now);
  robot.silent_us = std::chrono::duration_cast<std::chrono::microseconds>(now - entry.schedule.last_heard()).count();
  robot.lag_us = entry.lag_us;
  robot.next_sequence = ack.next_sequence;
  robot.seen_end = entry.intake.seen_end();
  for (const SequenceRange& range : ack.missing) robot.missing += range.to - range.from + 1;
  robot.incomplete = static_cast<std::uint32_t>(reassembly_.incomplete(session).size());
  robot.pending = entry.intake.pending();
  robot.credits = ack.credits;
  robot.refused = entry.intake.refusals();
  robot.not_taken = entry.not_taken;
  robot.blocked = blocked(entry).reason();
  if (entry.by_parts) robot.limit_hz = options_.max_keyframes_per_s;
  return robot;
}

std::vector<RobotStats> Intake::robots(SteadyTime now) {
  std::vector<RobotStats> all;
  all.reserve(sessions_.size() + silent_.size());
  Namesakes others = namesakes(now);
  for (auto& [session, entry] : sessions_) {
    all.push_back(stats_of(session, entry, now));
    all.back().same_name = std::move(others[session]);
  }
  for (const auto& [session, silent] : silent_) {
    if (silent.heard + options_.remember <= now) continue;
    RobotStats& robot = all.emplace_back(silent.stats);
    robot.silent_us = std::chrono::duration_cast<std::chrono::microseconds>(now - silent.heard).count();
  }
  return all;
}

std::map<SessionUuid, Owner> Intake::begun() const {
  std::map<SessionUuid, Owner> begun;
  for (const auto& [session, entry] : sessions_)
    if (entry.intake.has_begun()) begun.emplace_hint(begun.end(), session, owner_of(entry));
  return begun;
}

}  // namespace relmap::intake
