// One session on its way in: keyframes are judged in the order of their sequences, from a bounded window, and each
// sequence is settled exactly once: applied, refused, or given up. What is settled is in the journal before anybody is
// told. Single-threaded; IngestServer holds the lock.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "proto/keyframe/ingest_messages.h"
#include "server/intake/ingest_stats.h"
#include "server/intake/keyframe_sink.h"
#include "server/intake/reassembly.h"

namespace relmap::intake {

inline constexpr std::uint32_t kIntakeWindow = 64;         // sequences beyond the settled ones that are taken
inline constexpr std::uint32_t kMaxSequence = 0xfffffffe;  // the one after it is a number, too

class SessionIntake {
 public:
  // Journals a record as KeyframeSink::submit() does; the outcome comes to settle() under `ticket`.
  using Submit = std::function<Status(storage::JournalRecord record, std::uint64_t ticket)>;

  // Takes up what the map knows of the session. `robots`: those whose keyframes are taken, by name; empty: all.
  SessionIntake(const SessionUuid& uuid, KeyframeSink& sink, Submit submit, IngestStats& stats,
                const std::set<std::string>& robots);

  // What a keyframe with this checksum would be now.
  enum class Verdict { kTake, kRepeat, kConflict, kSettled, kDeleted, kTooFar };
  Verdict classify(std::uint32_t sequence, std::uint32_t crc);

  // A whole payload, with classify() == kTake. Its reason if it is to be refused: the sequence is settled by that once
  // its turn comes.
  Status take(std::uint32_t sequence, Reassembly::Payload payload);
  // from <= to.
  void give_up(std::uint32_t from, std::uint32_t to, Reason reason);
  // A sequence of which something came: those below that did not come are missing.
  void seen(std::uint32_t sequence);
  // To be refused in the next acknowledgements, though the sequence is settled.
  void note_conflict(std::uint32_t sequence, std::uint32_t crc, Reason reason);
  // The robot has no more keyframes for now. Journalled if everything below `next_sequence` is settled; otherwise it is
  // to be said again. Nothing happens where the session has ended already, or is not open.
  void end(std::uint64_t next_sequence);

  // Submits what has its turn. Called after take() and give_up(), and again while blocked() is not OK.
  void advance();
  // The outcome of a submitted record.
  void settle(std::uint64_t ticket, const Status& outcome);

  // Why nothing is being journalled: OK, BUDGET_EXCEEDED (it will pass), DISK_FULL,
  // IO_ERROR (as soon as the disk does), READ_ONLY, SHUTTING_DOWN ...
  const Status& blocked() const { return blocked_; }

  std::uint64_t next_sequence() const { return durable_; }
  // An end that was said is in the journal, and no keyframe came since.
  bool ended() const { return ended_; }
  std::uint64_t turn() const { return turn_; }
  // Sequences received and not settled.
  std::uint32_t pending() const { return static_cast<std::uint32_t>(turn_ - durable_ + held_.size()); }
  // Sequences below one that came have not come.
  bool has_missing() const { return seen_ > turn_ + held_.size(); }
  // Bytes of whole keyframes that wait for one before them.
  std::size_t waiting_bytes() const { return waiting_bytes_; }
  // Lets go of the last of these; it is asked for again.
  void drop_last_waiting();
  // The session is in the journal.
  bool begun() const { return number_.has_value(); }
  // 0: it is not.
  SessionNumber number() const { return number_.value_or(0); }
  // As its newest sound keyframe said, until it begins; nil uuid: none came.
  const SessionHeader& header() const { return header_; }
  std::uint64_t seen_end() const { return std::max(seen_, turn_); }
  std::optional<std::int64_t> durable_time_us() const { return durable_time_us_; }
  // Keyframes refused for good, since the object was made.
  const std::map<Reason, std::uint64_t>& refusals() const { return refusals_; }
  // Of what came, forgets all that is not in the journal or on its way there.
  void let_go();
  // Nothing is under way, and the map shows all that was settled: the object can be made anew at any time.
  bool idle();
  // All but boot id and credits.
  Acknowledgement acknowledgement(const Reassembly& reassembly) const;

 private:
  struct Held {
    std::uint32_t crc = 0;
    Status verdict;  // of the keyframe by itself
    std::int64_t time_us = 0;
    SessionHeader header;
    Bytes payload;  // empty if refused
    ReassemblyCharge charge;
  };
  using BeforeBegin =
      std::variant<storage::GapRecord, storage::RefusalRecord>;  // settled while the session had no number
  // What became of a sequence that was judged here.
  struct Judged {
    std::uint32_t crc = 0;
    Reason reason = Reason::OK;  // refused
    bool gap = false;
  };
  struct Submitted {
    std::uint64_t ticket = 0;
    std::uint64_t end = 0;  // 1 + its last sequence; 0: settled before the session began
    std::int64_t time_us = 0;
    bool keyframe = false;
    bool session_end = false;
    std::optional<Status> outcome;
    std::optional<BeforeBegin> before_begin;
  };
  struct GivenUp {
    std::uint32_t to = 0;
    Reason reason = Reason::DROPPED_BY_ROBOT;
  };

  std::optional<Judged> judged(std::uint32_t sequence);
  Status judge_in_turn(const Held& held) const;
  Status judge_session() const;
  bool begin(const SessionHeader& header);
  bool journal_before_begin();
  bool judge_keyframe(std::uint32_t sequence, Held& held);
  bool judge_gap(std::uint32_t to, Reason reason);
  bool submit(storage::JournalRecord record, std::uint64_t end, std::int64_t time_us, bool keyframe);
  void remember_refusal(std::uint32_t sequence, std::uint32_t crc, Reason reason);
  void roll_back();
  void prune_judged();
  void add_ranges(Acknowledgement& ack, const std::vector<std::uint32_t>& incomplete) const;

  const SessionUuid uuid_;
  KeyframeSink& sink_;
  const Submit submit_;
  IngestStats& stats_;
  const std::set<std::string>& robots_;

  std::optional<SessionNumber> number_;  // nothing durable yet without it
  SessionHeader header_;
  std::deque<BeforeBegin> before_begin_;  // journalled next, when there is a number

  std::uint64_t durable_ = 0;  // every sequence below is settled
  std::uint64_t turn_ = 0;     // every sequence below is judged, those from durable_ on not yet durable
  std::uint64_t seen_ = 0;     // 1 + the highest that something came of
  std::map<std::uint32_t, Held> held_;
  std::size_t waiting_bytes_ = 0;  // of held_
  std::map<std::uint32_t, GivenUp> given_up_;
  std::deque<Submitted> submitted_;
  std::uint64_t next_ticket_ = 1;

  std::optional<std::int64_t> durable_time_us_;  // of the last accepted keyframe
  std::optional<std::int64_t> turn_time_us_;
  std::map<std::uint32_t, Judged> judged_;  // not yet in the view, or looked up there
  std::deque<Refused> refused_;             // settled ones, newest at the end
  std::deque<Refused> conflicts_;
  std::map<Reason, std::uint64_t> refusals_;
  bool ended_ = false;
  Status blocked_;
  bool broken_ = false;
};

}  // namespace relmap::intake
