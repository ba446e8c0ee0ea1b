// The way to the daemon and back: LCM, gRPC, or a test's.
#pragma once

#include <cstddef>
#include <functional>

#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

// Loses, doubles and reorders as it likes; a lossless one loses only what was on its way when it broke, and says so.
class PublishTransport {
 public:
  virtual ~PublishTransport() = default;

  // Of a keyframe's payload in one part. `usual`: where nobody says otherwise.
  struct PartBytes {
    std::size_t least = kMinPartBytes, usual = kNetworkPartBytes, most = kMaxPartBytes;
  };
  virtual PartBytes part_bytes() const { return {}; }

  virtual bool lossless() const { return false; }

  // Why nothing gets through, as far as is known; OK: it does, or there is no telling. From any thread.
  virtual Status trouble() const { return {}; }

  // Called from one thread. Return at once.
  virtual void send(const KeyframePart& part) = 0;
  virtual void send(const Gap& gap) = 0;
  virtual void send(const SessionEnd& end) = 0;

  // What the daemon says, of any session, from a thread of the transport's, from listen() until stop() has returned.
  struct Listener {
    std::function<void(const Acknowledgement&)> acknowledged;
    std::function<void(const PoseNews&)> news;
    std::function<void()> broken;  // of a lossless transport: what was sent and is not acknowledged may be lost
    // Which map the daemon of a boot serves. Of a lossless transport before anything else that this daemon says, and
    // again after `broken`; of another now and then, and from an old daemon never.
    std::function<void(const DaemonIdentity&)> introduced = {};
  };
  virtual void listen(Listener listener) = 0;
  virtual void stop() = 0;
};

}  // namespace relmap::publishing
