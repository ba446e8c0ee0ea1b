// An LCM connection and the thread that receives on it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap {

// Returns `url` with relmap's defaults for options that it lacks: for udpm, ttl=0 (nothing leaves the machine) and a
// receive buffer of 4 MiB. INVALID_ARGUMENT if it is no LCM URL (udpm, file, memq) or check_lcm_url() refuses it.
Result<std::string> complete_lcm_url(const std::string& url);

// True if datagrams sent to this URL stay on this machine.
bool stays_on_this_machine(const std::string& complete_url);

// Tests whether a datagram sent to the group of a udpm URL comes back. NO_MULTICAST_ROUTE, with the commands that
// repair it, if none does. Takes about a millisecond if one does, and about a second if not.
Status probe_multicast(const std::string& complete_url);

class LcmLink {
 public:
  // Called on the link's thread with the bytes of one message.
  using Handler = std::function<void(ByteSpan message)>;
  using Handlers = std::vector<std::pair<std::string, Handler>>;  // by channel

  // Completes and probes `url`, subscribes, and starts the thread. INVALID_ARGUMENT, NO_MULTICAST_ROUTE, IO_ERROR.
  // `queue_bytes`: how much may wait for each handler, at 64 KiB per message; further messages are lost.
  static Result<std::unique_ptr<LcmLink>> open(const std::string& url, Handlers handlers,
                                               std::size_t queue_bytes = std::size_t{64} << 20);
  ~LcmLink();

  // Sends a message, which may be lost without notice. Does nothing if the link replays a log. Thread-safe.
  void publish(const char* channel, const Bytes& message);

  // True once a replayed log has ended.
  bool at_end() const;
  // Stops receiving. When this returns, no handler is running and none will be called.
  void stop();

 private:
  struct Impl;
  explicit LcmLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap
