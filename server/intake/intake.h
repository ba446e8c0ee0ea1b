// All sessions on their way in: parts and gaps to records for the journal, outcomes to acknowledgements. Pure but for
// its sink: time is an argument. Single-threaded; IngestServer puts a lock and a thread round it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "server/intake/acknowledgement.h"
#include "server/intake/ingest_stats.h"
#include "server/intake/rate_meter.h"
#include "server/intake/robot_event.h"
#include "server/intake/session_intake.h"

namespace relmap::intake {

inline constexpr std::uint32_t kMaxGapSequences = 1'000'000;  // in one message

struct IntakeOptions {
  AcknowledgementTimes times;
  std::size_t max_sessions =
      1024;  // at a time; the one that was silent longest makes room if it has not begun or is settled
  std::chrono::seconds patience{60};   // with a robot that says no more: then what it left unfinished is let go of
  std::chrono::seconds remember{600};  // since it was heard last: so long robots() tells of one that did not end
  // What a session may bring in parts, keyframes a second in the long run; what was saved up while it brought less may
  // come at once (kIntakeWindow, or two seconds' worth). 0: any number.
  double max_keyframes_per_s = 0;
  std::set<std::string> robots;  // whose keyframes are taken, by name; empty: all
};

class Intake {
 public:
  // `wake` is called from the sink's threads when poll() has something to do; it must not call back.
  Intake(KeyframeSink& sink, storage::Budget& budget, const BootId& boot, IntakeOptions options,
         std::function<void()> wake);
  ~Intake();

  // None of these fails: what is wrong is counted by its reason, and the acknowledgement says what is to be done.
  void take_part(const KeyframePart& part, SteadyTime now);
  void take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload,
                    SteadyTime now);
  void take_gap(const Gap& gap, SteadyTime now);
  void take_end(const SessionEnd& end, SteadyTime now);
  // Something arrived that is no message (CORRUPT) or one of another protocol (UNKNOWN_PROTOCOL_VERSION).
  void count_foreign(Reason reason);

  // Takes in the outcomes of what was journalled, tries again what was blocked, and returns what is to be said now.
  std::vector<Acknowledgement> poll(SteadyTime now);
  // And what robots are to be told besides: that their session has ended, at what pace to go on. Since the last call.
  std::vector<PoseNews> take_news();
  // What is to be logged of robots, since the last call.
  std::vector<RobotEvent> take_events();
  // When poll() has something to do, if nothing happens before.
  SteadyTime next_due(SteadyTime now) const;

  // NO_SUCH_SESSION if nothing is known of it.
  Result<Acknowledgement> acknowledgement(const SessionUuid& session);
  IngestStats stats() const;
  // Of all sessions that are being taken in, and of robots that fell silent without an end, in no order.
  std::vector<RobotStats> robots(SteadyTime now);
  // Sessions that answer for what they send: they have begun.
  std::set<SessionUuid> begun() const;
  // Another number whenever begun() may be another set.
  std::uint64_t begun_version() const { return begun_version_; }

 private:
  struct Entry {
    SessionIntake intake;
    AcknowledgementSchedule schedule;
    double payload_bytes = 64 * 1024;  // running mean
    RateMeter keyframes{}, bytes{};
    std::int64_t lag_us = -1;
    std::map<Reason, std::uint64_t> not_taken{};
    bool by_parts = false;  // comes over a transport that has no flow control of its own
    double paced_end = 0;   // 1 + the highest sequence that may come now
    SteadyTime paced_at{};
    SteadyTime limited_at{};       // that was in its way last
    SteadyTime held_back_since{};  // it wants to bring more than is taken; epoch: it does not
    SteadyTime slowed_at{};        // it was told so; epoch: it was not
    SteadyTime heard_first{};
    bool begun = false;
    bool announced = false;      // there was an event: it is heard,
    bool namesake_told = false;  // another of its name is
  };
  // A robot that fell silent without an end, as it was heard last.
  struct Silent {
    RobotStats stats;
    SteadyTime heard;
  };
  using Namesakes = std::map<SessionUuid, std::vector<SessionUuid>>;
  // What the sink has said about submitted records, until poll().
  struct Outcomes {
    struct Outcome {
      SessionUuid session;
      std::uint64_t ticket = 0;
      Status status;
    };
    std::mutex mutex;
    std::vector<Outcome> list;
    std::function<void()> wake;
  };

  Entry* open(const SessionUuid& session, SteadyTime now);
  bool make_room(SteadyTime now);
  bool drop_waiting(std::size_t more_than);
  void forget_silent(SteadyTime now);
  void remember(const SessionUuid& session, Entry& entry, SteadyTime now);
  RobotStats stats_of(const SessionUuid& session, Entry& entry, SteadyTime now);
  Namesakes namesakes(SteadyTime now) const;
  void tell_of_namesakes(SteadyTime now);
  void note(RobotEvent::Kind kind, const SessionUuid& session, const Entry& entry, SteadyTime now);
  bool wanted(Entry& entry, std::uint32_t sequence, std::uint32_t crc);
  void replenish(Entry& entry, SteadyTime now);
  bool paced(Entry& entry, std::uint32_t sequence, SteadyTime now);
  void tell_pace(const SessionUuid& session, Entry& entry, SteadyTime now);
  void tell(const SessionUuid& session, PoseNews::Kind kind, double rate_hz = 0);
  void take_whole(Entry& entry, const SessionUuid& session, std::uint32_t sequence, Reassembly::Payload payload,
                  SteadyTime now);
  void take_outcomes(SteadyTime now);
  void advance(const SessionUuid& session, Entry& entry, SteadyTime now);
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
  const IntakeOptions options_;
  const std::shared_ptr<Outcomes> outcomes_;
  IngestStats stats_;
  Reassembly reassembly_;
  std::map<SessionUuid, Entry> sessions_;
  std::map<SessionUuid, Silent> silent_;  // of none of sessions_
  SteadyTime looked_for_namesakes_{};
  SessionUuid first_served_;  // from which session on room is given out next
  std::vector<PoseNews> news_;
  std::vector<RobotEvent> events_;
  std::uint64_t begun_version_ = 0;
};

}  // namespace relmap::intake
