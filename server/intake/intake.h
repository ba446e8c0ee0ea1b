// Takes in all sessions: turns parts and gaps into records for the journal, and their outcomes into acknowledgements.
// Deterministic apart from the sink, since time is an argument. Not thread-safe; IngestServer adds a lock and threads.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/mutex.h"
#include "proto/base/turn_queue.h"
#include "server/intake/acknowledgement.h"
#include "server/intake/ingest_stats.h"
#include "server/intake/known_session.h"
#include "server/intake/rate_meter.h"
#include "server/intake/session_intake.h"

namespace relmap::intake {

inline constexpr std::uint32_t kMaxGapSequences = 1'000'000;  // of one gap message

// What may be sent; it can change while the daemon runs.
struct IntakeLimits {
  // Mean number of keyframes that a session may send in parts, per second; 0: no limit. A session that sent less may
  // catch up by kIntakeWindow keyframes or two seconds' worth, whichever is more.
  double max_keyframes_per_s = 0;
  // Mean number of sessions that one robot may begin, per minute, if it is proved who it is; so many may be begun at
  // once. Who proves nothing may begin ten times as many together with all others of the same address, or of unknown
  // addresses. 0: no limit.
  double max_new_sessions_per_min = 0;
  std::set<std::string> robots;  // names of the robots whose keyframes are taken; empty: all
};

struct IntakeOptions : IntakeLimits {
  AcknowledgementTimes times;
  // Sessions at a time. A new one replaces the longest silent of those that have nothing pending or have not begun, but
  // none that a robot has announced which has fewer than the newcomer; or else of a party that has more of them than
  // its own.
  std::size_t max_sessions = 1024;
  std::chrono::seconds patience{60};   // after so long a silence a robot's unfinished keyframes are dropped
  std::chrono::seconds remember{600};  // robots() lists a robot that did not end for so long after it was last heard
  std::set<std::string> proving;       // for these nobody may send who proves nothing (Sender::anyone)
};

class Intake {
 public:
  // `wake` is called from the sink's threads when poll() has something to do; it must not call back.
  Intake(KeyframeSink& sink, storage::Budget& budget, const BootId& boot, IntakeOptions options,
         std::function<void()> wake);
  ~Intake();

  // From now on these limits are in force.
  void limit(const IntakeLimits& limits) { static_cast<IntakeLimits&>(options_) = limits; }

  // What must be read of the map before a message of this session, or of a keyframe with this sequence, can be taken in
  // without waiting for the disk; nullopt: nothing. The answer is passed to know(). What was not asked for is read when
  // it is needed.
  // Nothing is read for a sender who may not send for a session that is being taken in.
  std::optional<MapQuestion> question(const SessionUuid& session, std::optional<std::uint32_t> sequence,
                                      const Sender& sender = {}) const;
  // With whom a message of this sender to this session shares its turn.
  Party party(const SessionUuid& session, const Sender& sender) const;
  void know(const MapQuestion& question, MapAnswer answer);

  // Errors are counted by reason, and the next acknowledgement tells the robot what to do. NOT_ALLOWED, and nothing is
  // done, if the sender may not send for the session: it is another robot's, or its robot must be proved.
  void take_part(const KeyframePart& part, SteadyTime now, const Sender& sender = {});
  Status take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload,
                      SteadyTime now, const Sender& sender = {});
  Status take_gap(const Gap& gap, SteadyTime now, const Sender& sender = {});
  Status take_end(const SessionEnd& end, SteadyTime now, const Sender& sender = {});
  // The robot announces that it will send the session: if it has not begun, it is this robot's, whoever knows its uuid
  // now. NOT_ALLOWED if it is another's.
  Status claim(const SessionUuid& session, SteadyTime now, const Sender& sender);
  // Counts bytes that are no message (CORRUPT) or a message of another protocol (UNKNOWN_PROTOCOL_VERSION).
  void count_foreign(Reason reason);

  // The robot whose session it is; empty: nobody has proved yet to be that, or it is neither being taken in nor silent.
  std::string robot_of(const SessionUuid& session) const;

  // Handles the outcomes of journalled records, retries what was blocked, and returns the acknowledgements to send now.
  std::vector<Acknowledgement> poll(SteadyTime now);
  // Other news for robots since the last call: that their session has ended, at what rate to go on.
  std::vector<PoseNews> take_news();
  // Events for the log since the last call.
  std::vector<RobotEvent> take_events();
  // When to call poll() next, if nothing happens before.
  SteadyTime next_due(SteadyTime now) const;

  // The session's present acknowledgement. NO_SUCH_SESSION if neither the intake nor the map knows it.
  Result<Acknowledgement> acknowledgement(const SessionUuid& session);
  IngestStats stats(SteadyTime now) const;
  // All sessions that are being taken in, and robots that fell silent without an end, in no particular order.
  std::vector<RobotStats> robots(SteadyTime now);
  // Sessions that have begun, with their robots. Only these have memory and queues of their own.
  std::map<SessionUuid, Owner> begun() const;
  // Changes whenever begun() may have changed.
  std::uint64_t begun_version() const { return begun_version_; }

 private:
  struct Entry {
    SessionIntake intake;
    AcknowledgementSchedule schedule;
    std::optional<Sender> sender{};    // of the first message, or the first that is proved, while it has not begun
    Party party{};                     // counted in places_
    double payload_bytes = 64 * 1024;  // running mean of keyframe sizes
    RateMeter keyframes{}, bytes{};
    std::int64_t lag_us = -1;
    std::map<Reason, std::uint64_t> not_taken{};
    bool by_parts = false;         // it comes over a transport without flow control
    double paced_end = 0;          // 1 + the highest sequence that the rate limit admits now
    SteadyTime paced_at{};         // when paced_end was computed
    SteadyTime limited_at{};       // when the rate limit last held it back
    SteadyTime held_back_since{};  // since when it sends more than is taken; epoch: it does not
    SteadyTime slowed_at{};        // when it was last told to slow down; epoch: never, or told to resume
    SteadyTime heard_first{};
    SteadyTime claimed{};      // before it has begun, when its robot announced it last
    SteadyTime begin_again{};  // when it may try to begin again, after it was refused that
    bool in_line = false;
    bool may_begin = false;      // counted among the new sessions of its sender
    bool announced = false;      // kHeard has been logged
    bool namesake_told = false;  // kSameName has been logged
  };
  // What was asked of a session that is not taken in yet.
  struct Known {
    Status failed;
    KnownSession session;
    std::map<std::uint32_t, Judged> judged;
  };
  // A robot that fell silent without an end, as it was last heard.
  struct Silent {
    RobotStats stats;
    SteadyTime heard;
  };
  // What is left of the sessions that a sender may begin.
  struct Allowance {
    double left = 0;
    SteadyTime at{};
  };
  using Namesakes = std::map<SessionUuid, std::vector<SessionUuid>>;
  // Outcomes of submitted records and of beginnings, from the sink's threads until poll().
  struct Outcomes {
    struct Outcome {
      SessionUuid session;
      std::uint64_t ticket = 0;
      Status status;
    };
    Mutex mutex;
    std::vector<Outcome> list RELMAP_GUARDED_BY(mutex);
    std::vector<std::pair<SessionUuid, Result<SessionNumber>>> begun RELMAP_GUARDED_BY(mutex);
    std::function<void()> wake RELMAP_GUARDED_BY(mutex);
  };

  Result<Known*> known(const SessionUuid& session);
  Result<Entry*> open(const SessionUuid& session, SteadyTime now, const Sender& sender);
  Status check_sender(const SessionUuid& session, const Entry& entry, const Sender& sender) const;
  Owner owner_of(const std::string& robot) const;
  Owner owner_of(const Entry& entry) const;  // of one that has begun
  void count(Entry& entry, const Party& party);
  using Sessions = std::map<SessionUuid, Entry>;
  Sessions::iterator erase(Sessions::iterator at);
  void forget(Sessions::iterator at);
  std::size_t places_for(const Party& newcomer) const;
  std::size_t places_of(const Party& party) const;
  bool make_room(const Party& newcomer, SteadyTime now);
  bool drop_waiting(std::size_t more_than);
  void forget_silent(SteadyTime now);
  void remember(const SessionUuid& session, Entry& entry, SteadyTime now);
  RobotStats stats_of(const SessionUuid& session, Entry& entry, SteadyTime now);
  Namesakes namesakes(SteadyTime now) const;
  void tell_of_namesakes(SteadyTime now);
  void note(RobotEvent::Kind kind, const SessionUuid& session, const Entry& entry, SteadyTime now);
  const Status& blocked(const Entry& entry) const;
  bool wanted(Entry& entry, std::uint32_t sequence, std::uint32_t crc);
  void replenish(Entry& entry, SteadyTime now);
  bool may_begin(Entry& entry, const Sender& sender, SteadyTime now);
  bool paced(Entry& entry, std::uint32_t sequence, SteadyTime now);
  void tell_pace(const SessionUuid& session, Entry& entry, SteadyTime now);
  void tell(const SessionUuid& session, PoseNews::Kind kind, double rate_hz = 0);
  void take_whole(Entry& entry, const SessionUuid& session, std::uint32_t sequence, Reassembly::Payload payload,
                  SteadyTime now, const Sender& sender);
  void take_outcomes(SteadyTime now);
  void advance(const SessionUuid& session, Entry& entry, SteadyTime now);
  void try_to_begin(const SessionUuid& session, Entry& entry, SteadyTime now);
  void join_line(const SessionUuid& session, Entry& entry);
  void leave_line(const SessionUuid& session);
  void serve_line(SteadyTime now);
  bool imperfect(const SessionUuid& session, const Entry& entry) const;
  std::uint32_t credits(const SessionUuid& session, const Entry& entry) const;
  Acknowledgement make_acknowledgement(const SessionUuid& session, const Entry& entry) const;
  void count_part(Reason reason) { ++stats_.parts_refused[index_of(reason)]; }
  void count_part(Entry& entry, Reason reason) {
    count_part(reason);
    ++entry.not_taken[reason];
  }

  KeyframeSink& sink_;
  storage::Budget& budget_;
  const BootId boot_;
  IntakeOptions options_;
  const std::shared_ptr<Outcomes> outcomes_;
  IngestStats stats_;
  Reassembly reassembly_;
  Sessions sessions_;
  std::map<Party, std::size_t> places_;   // how many of sessions_ each party has
  std::map<SessionUuid, Known> known_;    // disjoint from sessions_, until they are taken in
  std::map<SessionUuid, Silent> silent_;  // disjoint from sessions_
  SteadyTime looked_for_namesakes_{};
  std::map<std::pair<std::string, std::string>, Allowance> allowances_;  // by robot, or address; "": not known
  // Sessions that have something to submit, each once, by robot, in the order in which they are served, one record at a
  // time. It is empty but while the sink has no room: then robots take turns, and one that sends more than others, or
  // more sessions at a time, waits longer than they do.
  TurnQueue<SessionUuid> line_;
  Status no_room_;  // why the first of them waits
  std::vector<PoseNews> news_;
  std::vector<RobotEvent> events_;
  std::uint64_t begun_version_ = 0;
};

}  // namespace relmap::intake
