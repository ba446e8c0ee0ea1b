// Takes in one session. Keyframes are judged in the order of their sequences, from a bounded window. Each sequence is
// settled exactly once: journalled as a keyframe, refused, or given up. The robot is told only of what is in the
// journal. Not thread-safe; IngestServer holds the lock.
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
#include "server/intake/known_session.h"
#include "server/intake/reassembly.h"
#include "server/intake/sender.h"

namespace relmap::intake {

inline constexpr std::uint32_t kIntakeWindow = 64;         // how far beyond the settled sequences keyframes are taken
inline constexpr std::uint32_t kMaxSequence = 0xfffffffe;  // so that its successor fits in 32 bits, too

class SessionIntake {
 public:
  // Journals a record as KeyframeSink::submit() does; the caller passes the outcome to settle() with this ticket.
  using Submit = std::function<Status(storage::JournalRecord record, std::uint64_t ticket)>;

  // Begins a session as KeyframeSink::begin_session() does; the caller passes the outcome to begun().
  using Begin = std::function<void(const SessionHeader& header)>;

  // Resumes from what the map knows of the session. `robots` names the robots whose keyframes are taken; empty: all.
  // `proving` names those whose keyframes nobody may send who proves nothing.
  SessionIntake(const SessionUuid& uuid, KeyframeSink& sink, const KnownSession& known, Submit submit, Begin begin,
                IngestStats& stats, const std::set<std::string>& robots, const std::set<std::string>& proving);

  // What a keyframe with this sequence and checksum would be now. Reads the map unless it knows what became of the
  // sequence.
  enum class Verdict { kTake, kRepeat, kConflict, kSettled, kDeleted, kTooFar };
  Verdict classify(std::uint32_t sequence, std::uint32_t crc);
  bool knows(std::uint32_t sequence) const { return sequence >= turn_ || !number_ || judged_.contains(sequence); }
  void know(std::uint32_t sequence, const Judged& judged);

  // Takes a complete payload for which classify() returned kTake. Not OK: the reason for which the sequence will be
  // refused when its turn comes, NOT_ALLOWED if the sender may not send the keyframes of its robot.
  Status take(std::uint32_t sequence, Reassembly::Payload payload, const Sender& sender = {});
  // Takes a gap. Requires from <= to.
  void give_up(std::uint32_t from, std::uint32_t to, Reason reason);
  // Notes that something came of a sequence, so that lower ones of which nothing came are missing.
  void seen(std::uint32_t sequence);
  // Lists the keyframe as refused in the next acknowledgements, although its sequence is settled.
  void note_conflict(std::uint32_t sequence, std::uint32_t crc, Reason reason);
  // The robot has no more keyframes for now. Journals the end if everything below `next_sequence` is settled; otherwise
  // the robot has to repeat it. Does nothing if the session has ended already, or is frozen or deleted.
  void end(std::uint64_t next_sequence);

  // Submits the next record whose turn has come. False if there is none, or if blocked() is not OK now. Call it after
  // take() and give_up() until it returns false, and again while blocked() is not OK.
  bool submit_next();
  // Whether the next sequence has come, or has been given up, so that submit_next() has something to do.
  bool has_next() const;
  // Whether it is beginning.
  bool begins() const { return beginning_.has_value(); }
  // Handles the outcome of that.
  void begun(const Result<SessionNumber>& number);
  // Handles the outcome of a submitted record.
  void settle(std::uint64_t ticket, const Status& outcome);

  // Why nothing is being journalled; OK if it is. BUDGET_EXCEEDED passes by itself, DISK_FULL and IO_ERROR when the
  // disk recovers; READ_ONLY, SHUTTING_DOWN and others do not.
  const Status& blocked() const { return blocked_; }

  std::uint64_t next_sequence() const { return durable_; }
  // Whether the session's end is in the journal, and no keyframe came since.
  bool ended() const { return ended_; }
  std::uint64_t turn() const { return turn_; }
  // Sequences received and not settled.
  std::uint32_t pending() const { return static_cast<std::uint32_t>(turn_ - durable_ + held_.size()); }
  // Whether nothing came of some sequence below one that came.
  bool has_missing() const { return seen_ > turn_ + held_.size(); }
  // Bytes of complete keyframes that wait for an earlier one.
  std::size_t waiting_bytes() const { return waiting_bytes_; }
  // Drops the last of these; its robot is asked for it again.
  void drop_last_waiting();
  // Whether the session is in the journal.
  bool has_begun() const { return number_.has_value(); }
  // 0 if the session has not begun.
  SessionNumber number() const { return number_.value_or(0); }
  // Until the session begins, the header of its newest sound keyframe; nil uuid if none came.
  const SessionHeader& header() const { return header_; }
  // What the newest keyframe that was refused calls its robot and session, while no sound one came; empty: nothing that
  // could be shown.
  const std::string& claimed_robot() const { return claimed_robot_; }
  const std::string& claimed_name() const { return claimed_name_; }
  std::uint64_t seen_end() const { return std::max(seen_, turn_); }
  std::optional<std::int64_t> durable_time_us() const { return durable_time_us_; }
  // Keyframes refused for good since this object was made.
  const std::map<Reason, std::uint64_t>& refusals() const { return refusals_; }
  // Forgets everything that came and is neither in the journal nor submitted.
  void let_go();
  // Whether it would be idle() after that.
  bool is_let_go_idle();
  // Whether nothing is under way and the map shows everything settled, so that this object can be destroyed and made
  // again without loss.
  bool idle();
  // Fills in everything but boot id and credits.
  Acknowledgement acknowledgement(const Reassembly& reassembly) const;

 private:
  struct Held {
    std::uint32_t crc = 0;
    Status verdict;  // on the keyframe alone, without regard to its place in the session
    std::int64_t time_us = 0;
    SessionHeader header;
    Bytes payload;  // empty if refused
    ReassemblyCharge charge;
  };
  // Settled while the session had no number.
  using BeforeBegin = std::variant<storage::GapRecord, storage::RefusalRecord>;
  struct Submitted {
    std::uint64_t ticket = 0;
    std::uint64_t end = 0;  // 1 + its last sequence; 0: settled before the session began, or the session's end
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

  bool submit_in_turn();
  Judged judged(std::uint32_t sequence);
  void note_claim(const SessionHeader& header);
  Status judge_in_turn(const Held& held) const;
  Status judge_session() const;
  std::optional<storage::Session> session() const;
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
  const Begin begin_;
  IngestStats& stats_;
  const std::set<std::string>& robots_;
  const std::set<std::string>& proving_;

  std::optional<SessionNumber> number_;     // nullopt: nothing is durable yet
  std::shared_ptr<const void> record_;      // keeps the session's record in memory
  std::optional<SessionHeader> beginning_;  // what begin_() was called with, until begun()
  SessionHeader header_;
  std::string claimed_robot_, claimed_name_;
  mutable std::optional<storage::Session> last_read_;  // of session()
  std::deque<BeforeBegin> before_begin_;               // journalled first once there is a number

  std::uint64_t durable_ = 0;  // every sequence below is settled
  std::uint64_t turn_ = 0;     // every sequence below is judged; those from durable_ on are not durable yet
  std::uint64_t seen_ = 0;     // 1 + the highest sequence of which something came
  std::map<std::uint32_t, Held> held_;
  std::size_t waiting_bytes_ = 0;  // of held_
  std::map<std::uint32_t, GivenUp> given_up_;
  std::deque<Submitted> submitted_;
  std::uint64_t next_ticket_ = 1;

  std::optional<std::int64_t> durable_time_us_;  // of the last accepted keyframe
  std::optional<std::int64_t> turn_time_us_;
  std::map<std::uint32_t, Judged> judged_;  // those not in the view yet, and a cache of others
  std::deque<Refused> refused_;             // refused for good, newest at the end
  std::deque<Refused> conflicts_;
  std::map<Reason, std::uint64_t> refusals_;
  bool ended_ = false;
  Status blocked_;
  bool broken_ = false;
};

}  // namespace relmap::intake
