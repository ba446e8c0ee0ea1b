#include "tools/bench/fleet/shared_lcm.h"

#include <utility>

#include "proto/base/mutex.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::bench {

template <typename Message>
LcmLink::Handler SharedLcm::handler(
    Result<Message> (*decode)(ByteSpan),
    std::function<void(const Message&)> publishing::PublishTransport::Listener::*heard) {
  return [this, decode, heard](ByteSpan bytes) {
    const Result<Message> message = decode(bytes);
    if (!message.ok()) return;
    const MutexLock lock(mutex_);
    const auto listener = listeners_.find(message->session);
    if (listener != listeners_.end() && listener->second.*heard) (listener->second.*heard)(*message);
  };
}

std::shared_ptr<SharedLcm> SharedLcm::open(const std::string& url) {
  std::shared_ptr<SharedLcm> shared(new SharedLcm);
  using Listener = publishing::PublishTransport::Listener;
  shared->link_ =
      LcmLink::open(url, {{kAckChannel, shared->handler(decode_lcm_acknowledgement, &Listener::acknowledged)},
                          {kPoseChannel, shared->handler(decode_lcm_pose, &Listener::news)}})
          .or_throw();
  return shared;
}

void SharedLcm::listen(const SessionUuid& session, publishing::PublishTransport::Listener listener) {
  const MutexLock lock(mutex_);
  if (listener.acknowledged || listener.news)
    listeners_[session] = std::move(listener);
  else
    listeners_.erase(session);
}

}  // namespace relmap::bench
