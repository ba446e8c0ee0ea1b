// Sends parts of keyframes and gaps over LCM, and receives acknowledgements and news.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "frontend/publishing/publish_transport.h"
#include "proto/base/mutex.h"
#include "proto/wire/lcm_link.h"

namespace relmap::publishing {

class LcmTransport final : public PublishTransport {
 public:
  // INVALID_ARGUMENT, NO_MULTICAST_ROUTE, IO_ERROR.
  static Result<std::unique_ptr<LcmTransport>> open(const std::string& url);
  ~LcmTransport() override { stop(); }

  // On one machine, as large as a datagram may be. Over a network a large datagram is split into IP fragments and lost
  // with any of them, so the usual part fits a packet.
  PartBytes part_bytes() const override;
  void send(const KeyframePart& part) override;
  void send(const Gap& gap) override;
  void send(const SessionEnd& end) override;
  void listen(Listener listener) override;
  void stop() override;

 private:
  explicit LcmTransport(bool local) : local_(local) {}
  // Decodes the messages of a channel and passes them to a function of the listener. Others are ignored.
  template <typename Message>
  LcmLink::Handler handler(Result<Message> (*decode)(ByteSpan), std::function<void(const Message&)> Listener::*heard);

  const bool local_;  // datagrams stay on this machine
  Mutex mutex_;
  Listener listener_ RELMAP_GUARDED_BY(mutex_);
  std::unique_ptr<LcmLink> link_;
};

}  // namespace relmap::publishing
