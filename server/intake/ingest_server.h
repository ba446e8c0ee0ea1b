// Ingest as the transports see it: thread-safe, with the thread that says what there is to be said. LCM and the Ingest
// service feed it the same way; neither is known here.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "server/intake/intake.h"

namespace relmap::intake {

struct IngestServerOptions : IntakeOptions {
  // Parts that wait to be looked at; charged to Share::kReassembly while the server runs.
  std::size_t part_queue_bytes = std::size_t{4} << 20;
  MapIdentity map = {};  // that the keyframes go into, for robots to be told
};

class IngestServer {
 public:
  // Starts two threads. `sink` and `budget` outlive it.
  IngestServer(KeyframeSink& sink, storage::Budget& budget, const BootId& boot, IngestServerOptions options = {});
  // As stop().
  ~IngestServer();

  // Any thread. A part is checked, and waits in its sender's queue (part_queue.h): for transports without flow control.
  // Returns at once.
  void take_part(KeyframePart part);
  // As Intake's. Any thread; they may wait while a session begins.
  void take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload);
  void take_gap(Gap gap);
  void take_end(SessionEnd end);
  void count_foreign(Reason reason);
  Result<Acknowledgement> acknowledgement(const SessionUuid& session);
  IngestStats stats() const;
  std::vector<RobotStats> robots() const;
  // What robots are told first.
  const DaemonIdentity& identity() const;

  // News of a keyframe from elsewhere (a closure), to be told to whoever listens. Any thread; returns at once. Boot id
  // and time are filled in here.
  void tell(PoseNews news);

  // All that is to be said to robots from now on, from this object's thread, one at a time. The callbacks must not call
  // back and must not wait; they have returned for the last time when the Subscription is gone. `stopping`: the server
  // takes nothing more and has said all it had to.
  struct Listener {
    std::function<void(const Acknowledgement&)> acknowledged;
    std::function<void(const PoseNews&)> news;
    std::function<void()> stopping;
    std::function<void(const RobotEvent&)> robot = {};
  };
  class Subscription {
   public:
    virtual ~Subscription() = default;
  };
  std::unique_ptr<Subscription> subscribe(Listener listener);

  // Looks at what waits, says the last acknowledgements and ends the threads; what comes later is not taken.
  void stop();

 private:
  struct Impl;
  class Entry;
  std::shared_ptr<Impl> impl_;
};

}  // namespace relmap::intake
