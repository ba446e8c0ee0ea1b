// One LCM connection for the publishers of many robots, since each connection receives the messages for all of them.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "frontend/publishing/publish_transport.h"
#include "proto/base/mutex.h"
#include "proto/wire/lcm_link.h"

namespace relmap::bench {

class SharedLcm {
 public:
  static std::shared_ptr<SharedLcm> open(const std::string& url);  // throws

  void publish(const char* channel, const Bytes& message) { link_->publish(channel, message); }
  // Calls `listener` for messages about a session from now on. With an empty one, no call is running when this returns.
  void listen(const SessionUuid& session, publishing::PublishTransport::Listener listener);

 private:
  SharedLcm() = default;
  template <typename Message>
  LcmLink::Handler handler(Result<Message> (*decode)(ByteSpan),
                           std::function<void(const Message&)> publishing::PublishTransport::Listener::*heard);

  Mutex mutex_;  // listeners are called under it
  std::map<SessionUuid, publishing::PublishTransport::Listener> listeners_ RELMAP_GUARDED_BY(mutex_);
  std::unique_ptr<LcmLink> link_;
};

}  // namespace relmap::bench
