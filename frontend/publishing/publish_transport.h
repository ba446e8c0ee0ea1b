// The interface of transports to the daemon and back: LCM, gRPC, or a test's.
#pragma once

#include <cstddef>
#include <functional>

#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

// A transport may lose, duplicate and reorder messages. A lossless one loses only what was on its way when it broke,
// and reports that (Listener::broken).
class PublishTransport {
 public:
  virtual ~PublishTransport() = default;

  // How many bytes of a keyframe's payload one part may have.
  struct PartBytes {
    std::size_t min = kMinPartBytes, usual = kNetworkPartBytes, max = kMaxPartBytes;
  };
  virtual PartBytes part_bytes() const { return {}; }

  virtual bool lossless() const { return false; }

  // Why no messages get through, as far as is known; ok if they do, or if that is not known. Thread-safe.
  virtual Status trouble() const { return {}; }

  // Called once, before listen(): which session is sent, and into which map; nil: into any.
  virtual void sends_for(const SessionUuid& /*session*/, const Uuid& /*map*/) {}

  // Called from one thread. They do not block.
  virtual void send(const KeyframePart& part) = 0;
  virtual void send(const Gap& gap) = 0;
  virtual void send(const SessionEnd& end) = 0;

  // Receives the daemon's messages about all sessions, on a thread of the transport, from listen() until stop() has
  // returned.
  struct Listener {
    std::function<void(const Acknowledgement&)> acknowledged;
    std::function<void(const PoseNews&)> news;
    // A lossless transport broke: what was sent and is not acknowledged may be lost.
    std::function<void()> broken;
    // Which map the daemon of a boot serves. A lossless transport calls it before any other message of that daemon, and
    // again after `broken`; others call it now and then, and never for an old daemon.
    std::function<void(const DaemonIdentity&)> introduced = {};
  };
  virtual void listen(Listener listener) = 0;
  virtual void stop() = 0;
};

}  // namespace relmap::publishing
