// Ingest as the transports see it: thread-safe, with the thread that says what there is to be said. LCM and the Ingest
// service feed it the same way; neither is known here.
#pragma once

#include <functional>
#include <memory>

#include "server/intake/intake.h"

namespace relmap {

class IngestServer {
 public:
  // Starts one thread. `sink` and `budget` outlive it.
  IngestServer(KeyframeSink& sink, Budget& budget, const BootId& boot, IntakeOptions options = {});
  // As stop().
  ~IngestServer();

  // As Intake's. Any thread.
  void take_part(const KeyframePart& part);
  void take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload);
  void take_gap(const Gap& gap);
  void count_foreign(Reason reason);
  Result<Acknowledgement> acknowledgement(const SessionUuid& session);
  IngestStats stats() const;
  const BootId& boot() const;

  // Every acknowledgement from now on, from this object's thread, one at a time. The callback must not call back and
  // must not wait; it has returned for the last time when the Subscription is gone.
  class Subscription {
   public:
    virtual ~Subscription() = default;
  };
  std::unique_ptr<Subscription> subscribe(std::function<void(const Acknowledgement&)> callback);

  // Says the last acknowledgements and ends the thread; what comes later is not taken.
  void stop();

 private:
  struct Impl;
  class Entry;
  std::shared_ptr<Impl> impl_;
};

}  // namespace relmap
