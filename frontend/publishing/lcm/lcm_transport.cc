#include "frontend/publishing/lcm/lcm_transport.h"

#include <utility>

#include "frontend/publishing/publisher.h"
#include "proto/base/mutex.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::publishing {

template <typename Message>
LcmLink::Handler LcmTransport::handler(Result<Message> (*decode)(ByteSpan),
                                       std::function<void(const Message&)> Listener::*heard) {
  return [this, decode, heard](ByteSpan bytes) {
    const Result<Message> message = decode(bytes);
    if (!message.ok()) return;
    const MutexLock lock(mutex_);
    if (listener_.*heard) (listener_.*heard)(*message);
  };
}

Result<std::unique_ptr<LcmTransport>> LcmTransport::open(const std::string& url) {
  std::unique_ptr<LcmTransport> transport(new LcmTransport(stays_on_this_machine(url)));
  Result<std::unique_ptr<LcmLink>> link =
      LcmLink::open(url, {{kAckChannel, transport->handler(decode_lcm_acknowledgement, &Listener::acknowledged)},
                          {kPoseChannel, transport->handler(decode_lcm_pose, &Listener::news)},
                          {kMapChannel, transport->handler(decode_lcm_map, &Listener::introduced)}});
  if (!link.ok()) return link.status();
  transport->link_ = std::move(*link);
  return transport;
}

PublishTransport::PartBytes LcmTransport::part_bytes() const {
  return {kMinPartBytes, local_ ? kMaxPartBytes : kNetworkPartBytes, kMaxPartBytes};
}

void LcmTransport::send(const KeyframePart& part) { link_->publish(kKeyframeChannel, encode_lcm(part)); }

void LcmTransport::send(const Gap& gap) { link_->publish(kGapChannel, encode_lcm(gap)); }

void LcmTransport::send(const SessionEnd& end) { link_->publish(kEndChannel, encode_lcm(end)); }

void LcmTransport::listen(Listener listener) {
  const MutexLock lock(mutex_);
  listener_ = std::move(listener);
}

void LcmTransport::stop() {
  if (link_) link_->stop();
  listen({});
}

Result<std::unique_ptr<Publisher>> Publisher::start(PublisherOptions options, SessionHeader header) {
  const Result<std::string> url = complete_lcm_url(options.lcm_url);
  if (!url.ok()) return url.status();
  Result<std::unique_ptr<LcmTransport>> transport = LcmTransport::open(*url);
  if (!transport.ok()) return transport.status();
  return start(std::move(options), std::move(header), std::move(*transport));
}

}  // namespace relmap::publishing
