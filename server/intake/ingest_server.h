// The interface of ingest for transports: an Intake made thread-safe, with the threads that take in parts and send
// answers. LCM and the Ingest service use it in the same way; it knows neither.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "server/intake/intake.h"

namespace relmap::intake {

struct IngestServerOptions : IntakeOptions {
  // Capacity for parts that wait to be taken in; charged to Share::kReassembly while the server runs.
  std::size_t part_queue_bytes = std::size_t{4} << 20;
  MapIdentity map = {};  // the map that the keyframes go into; robots are told
};

class IngestServer {
 public:
  // Starts three threads. `sink` and `budget` must outlive the server.
  IngestServer(KeyframeSink& sink, storage::Budget& budget, const BootId& boot, IngestServerOptions options = {});
  // Calls stop().
  ~IngestServer();

  // All methods but stop() are thread-safe.

  // For transports without flow control: checks the part, queues it for its sender (part_queue.h) and returns at once.
  void take_part(KeyframePart part, Sender sender = {});
  // As Intake's. `taken` is called once with what the sender is to know, within the call or, if something has to be
  // read of the map first, from a thread of this object; then a later message may be taken in before. BUDGET_EXCEEDED
  // if too many wait for that, SHUTTING_DOWN after stop().
  using Taken = std::function<void(const Status&)>;
  void take_payload(const SessionUuid& session, std::uint32_t sequence, std::uint32_t crc, Bytes payload,
                    const Sender& sender, Taken taken = {});
  void take_gap(const Gap& gap, const Sender& sender, Taken taken = {});
  void take_end(const SessionEnd& end, const Sender& sender, Taken taken = {});
  void claim(const SessionUuid& session, const Sender& sender, Taken taken = {});
  void count_foreign(Reason reason);
  // May wait for the disk.
  Result<Acknowledgement> acknowledgement(const SessionUuid& session);
  IngestStats stats() const;
  std::vector<RobotStats> robots() const;
  // From now on these limits are in force.
  void limit(const IntakeLimits& limits);
  // Seconds that the thread which answers robots has been at its present round, or waits for those that take in; 0
  // between two rounds. Waits for nobody.
  double busy_s() const;
  // What robots are told before anything else.
  const DaemonIdentity& identity() const;

  // Passes news of a keyframe (a closure) on to the listeners, with boot id and time filled in, for the robot whose
  // session it is. Returns at once. News are dropped if too many wait.
  void tell(PoseNews news, std::string robot);

  // Calls the listener from now on with everything that robots are to be told, from this object's thread, one call at a
  // time. The callbacks must neither block nor call back. None of them runs any more once the Subscription is
  // destroyed. `stopping` is called once the server takes nothing more and has told everything. `robot` is the robot
  // whose session it is, empty while nobody has proved to be that: what it is told is not to be believed by others.
  struct Listener {
    std::function<void(const Acknowledgement&, const std::string& robot)> acknowledged;
    std::function<void(const PoseNews&, const std::string& robot)> news;
    std::function<void()> stopping;
    std::function<void(const RobotEvent&)> robot = {};
  };
  class Subscription {
   public:
    virtual ~Subscription() = default;
  };
  std::unique_ptr<Subscription> subscribe(Listener listener);

  // Takes in what waits, sends the last acknowledgements and ends the threads. Later messages are ignored.
  void stop();

 private:
  struct Impl;
  class Entry;
  explicit IngestServer(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace relmap::intake
