// One LCM connection for the publishers of many robots: as many of their own would each receive what all of them hear.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "frontend/publishing/publish_transport.h"
#include "proto/wire/lcm_link.h"

namespace relmap::bench {

class SharedLcm {
 public:
  static std::shared_ptr<SharedLcm> open(const std::string& url);  // throws

  void publish(const char* channel, const Bytes& message) { link_->publish(channel, message); }
  // What the daemon says of one session, from now on. Empty: nothing more, once this has returned.
  void listen(const SessionUuid& session, publishing::PublishTransport::Listener listener);

 private:
  SharedLcm() = default;
  template <typename Message>
  LcmLink::Handler handler(Result<Message> (*decode)(ByteSpan),
                           std::function<void(const Message&)> publishing::PublishTransport::Listener::*heard);

  std::mutex mutex_;
  std::map<SessionUuid, publishing::PublishTransport::Listener> listeners_;
  std::unique_ptr<LcmLink> link_;
};

}  // namespace relmap::bench
