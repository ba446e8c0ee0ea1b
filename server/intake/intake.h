// All sessions on their way in: parts and gaps to records for the journal, outcomes to acknowledgements. Pure but for
// its sink: time is an argument. Single-threaded; IngestServer puts a lock and a thread round it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "server/intake/acknowledgement.h"
#include "server/intake/ingest_stats.h"
#include "server/intake/session_intake.h"

namespace relmap {

inline constexpr std::uint32_t kMaxGapSequences = 1'000'000;  // in one message

struct IntakeOptions {
  AcknowledgementTimes times;
  std::size_t max_sessions =
      1024;  // at a time; the one that was silent longest makes room if it has not begun or is settled
  std::chrono::seconds patience{60};  // with a robot that says no more: then what it left unfinished is let go of
};

class Intake {
 public:
  // `wake` is called from the sink's threads when poll() has something to do; it must not call back.
  Intake(KeyframeSink& sink, Budget& budget, const BootId& boot, IntakeOptions options, std::function<void()> wake);
  ~Intake();

  // None of these fails: what is wrong is counted by its reason, and the acknowledgement says what is to be done.
  void take_part(const KeyframePart& part, SteadyTime now);
  void take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload,
                    SteadyTime now);
  void take_gap(const Gap& gap, SteadyTime now);
  // Something arrived that is no message (CORRUPT) or one of another protocol (UNKNOWN_PROTOCOL_VERSION).
  void count_foreign(Reason reason);

  // Takes in the outcomes of what was journalled, tries again what was blocked, and returns what is to be said now.
  std::vector<Acknowledgement> poll(SteadyTime now);
  // When poll() has something to do, if nothing happens before.
  SteadyTime next_due(SteadyTime now) const;

  // NO_SUCH_SESSION if nothing is known of it.
  Result<Acknowledgement> acknowledgement(const SessionUuid& session);
  IngestStats stats() const;

 private:
  struct Entry {
    SessionIntake intake;
    AcknowledgementSchedule schedule;
    double payload_bytes = 64 * 1024;  // running mean
  };
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
  bool make_room();
  void forget_silent(SteadyTime now);
  bool wanted(Entry& entry, std::uint32_t sequence, std::uint32_t crc);
  void take_whole(Entry& entry, const SessionUuid& session, std::uint32_t sequence, Reassembly::Payload payload);
  void take_outcomes();
  void advance(const SessionUuid& session, Entry& entry);
  bool imperfect(const SessionUuid& session, const Entry& entry) const;
  std::uint32_t credits(const SessionUuid& session, const Entry& entry) const;
  Acknowledgement make_acknowledgement(const SessionUuid& session, const Entry& entry) const;
  void count_part(Reason reason) { ++stats_.parts_refused[index_of(reason)]; }

  KeyframeSink& sink_;
  Budget& budget_;
  const BootId boot_;
  const IntakeOptions options_;
  const std::shared_ptr<Outcomes> outcomes_;
  IngestStats stats_;
  Reassembly reassembly_;
  std::map<SessionUuid, Entry> sessions_;
};

}  // namespace relmap
