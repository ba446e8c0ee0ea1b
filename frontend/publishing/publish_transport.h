// The way to the daemon and back: LCM, or a test's.
#pragma once

#include <functional>

#include "proto/ingest_messages.h"

namespace relmap {

// Loses, doubles and reorders as it likes.
class PublishTransport {
 public:
  virtual ~PublishTransport() = default;

  // Called from one thread. Return at once.
  virtual void send(const KeyframePart& part) = 0;
  virtual void send(const Gap& gap) = 0;
  virtual void send(const SessionEnd& end) = 0;

  // What the daemon says, of any session, from a thread of the transport's, from listen() until stop() has returned.
  struct Listener {
    std::function<void(const Acknowledgement&)> acknowledged;
    std::function<void(const PoseNews&)> news;
  };
  virtual void listen(Listener listener) = 0;
  virtual void stop() = 0;
};

}  // namespace relmap
