#include "frontend/publishing/lcm/lcm_transport.h"

#include <utility>

#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap {

Result<std::unique_ptr<LcmTransport>> LcmTransport::open(const std::string& url) {
  std::unique_ptr<LcmTransport> transport(new LcmTransport);
  LcmTransport* const receiver = transport.get();
  Result<std::unique_ptr<LcmLink>> link =
      LcmLink::open(url, {{kAckChannel, [receiver](ByteSpan message) { receiver->receive_acknowledgement(message); }},
                          {kPoseChannel, [receiver](ByteSpan message) { receiver->receive_news(message); }}});
  if (!link.ok()) return link.status();
  transport->link_ = std::move(*link);
  return transport;
}

void LcmTransport::receive_acknowledgement(ByteSpan message) {
  const Result<Acknowledgement> ack = decode_lcm_acknowledgement(message);
  if (!ack.ok()) return;
  const std::lock_guard lock(mutex_);
  if (listener_.acknowledged) listener_.acknowledged(*ack);
}

void LcmTransport::receive_news(ByteSpan message) {
  const Result<PoseNews> news = decode_lcm_pose(message);
  if (!news.ok()) return;
  const std::lock_guard lock(mutex_);
  if (listener_.news) listener_.news(*news);
}

void LcmTransport::send(const KeyframePart& part) { link_->publish(kKeyframeChannel, encode_lcm(part)); }

void LcmTransport::send(const Gap& gap) { link_->publish(kGapChannel, encode_lcm(gap)); }

void LcmTransport::listen(Listener listener) {
  const std::lock_guard lock(mutex_);
  listener_ = std::move(listener);
}

void LcmTransport::stop() {
  if (link_) link_->stop();
  listen({});
}

}  // namespace relmap
