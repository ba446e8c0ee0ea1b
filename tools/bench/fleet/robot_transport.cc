#include "tools/bench/fleet/robot_transport.h"

#include <utility>

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

RobotTransport::RobotTransport(std::shared_ptr<SharedLcm> lcm, const SessionUuid& session, std::uint32_t robot,
                               const DeedLog& log)
    : lcm_(std::move(lcm)), session_(session), robot_(robot), log_(log) {}

void RobotTransport::send(const KeyframePart& part) {
  *sent_bytes_ += part.data.size();
  lcm_->publish(kKeyframeChannel, encode_lcm(part));
}

void RobotTransport::send(const Gap& gap) { lcm_->publish(kGapChannel, encode_lcm(gap)); }

void RobotTransport::send(const SessionEnd& end) { lcm_->publish(kEndChannel, encode_lcm(end)); }

void RobotTransport::listen(Listener listener) {
  auto hear = std::move(listener.acknowledged);
  listener.acknowledged = [this, hear = std::move(hear)](const Acknowledgement& ack) {
    if (ack.next_sequence > acknowledged_) {
      acknowledged_ = ack.next_sequence;
      log_.add({Deed::Kind::kAcknowledged, robot_, acknowledged_, *sent_bytes_, monotonic_ns()});
    }
    hear(ack);
  };
  lcm_->listen(session_, std::move(listener));
}

}  // namespace relmap::bench
