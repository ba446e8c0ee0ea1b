// One LCM connection and the thread that receives on it.
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

// The URL with what relmap needs unless it says otherwise: for udpm ttl=0 (nothing leaves the machine) and a receive
// buffer of 4 MiB. INVALID_ARGUMENT if it is no LCM URL (udpm, file, memq), or check_lcm_url() finds something wrong.
Result<std::string> complete_lcm_url(const std::string& url);

// True if datagrams sent there stay on this machine.
bool stays_on_this_machine(const std::string& complete_url);

// Sends to the group of a udpm URL and hears itself. NO_MULTICAST_ROUTE, with the commands that mend it, if it cannot.
// Takes under a second where all is well a millisecond.
Status probe_multicast(const std::string& complete_url);

class LcmLink {
 public:
  // Called from the link's thread, with the bytes of one message.
  using Handler = std::function<void(ByteSpan message)>;
  using Handlers = std::vector<std::pair<std::string, Handler>>;  // by channel

  // complete_lcm_url(), probe_multicast(), then the thread. INVALID_ARGUMENT, NO_MULTICAST_ROUTE, IO_ERROR.
  // `queue_bytes`: what may wait for each handler; what comes then is lost, as datagrams are.
  static Result<std::unique_ptr<LcmLink>> open(const std::string& url, Handlers handlers,
                                               std::size_t queue_bytes = std::size_t{64} << 20);
  ~LcmLink();

  // Thread-safe; what is lost on the way is lost in silence. A log that is being replayed takes nothing.
  void publish(const char* channel, const Bytes& message);

  // A log that was replayed is at its end.
  bool at_end() const;
  // No handler is called after it has returned.
  void stop();

 private:
  struct Impl;
  explicit LcmLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap
