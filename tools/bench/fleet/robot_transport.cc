#include "tools/bench/fleet/robot_transport.h"

#include <utility>

namespace relmap::bench {

std::shared_ptr<SharedLcm> SharedLcm::open(const std::string& url) {
  std::shared_ptr<SharedLcm> shared(new SharedLcm);
  LcmLink::Handlers handlers;
  for (const char* channel : publishing::LcmTransport::heard_channels())
    handlers.emplace_back(channel, [heard = shared.get(), channel](ByteSpan datagram) {
      const MutexLock lock(heard->mutex_);
      for (publishing::LcmTransport* transport : heard->transports_) transport->hear(channel, datagram);
    });
  shared->link_ = LcmLink::open(url, std::move(handlers)).or_throw();
  return shared;
}

void SharedLcm::add(publishing::LcmTransport& transport) {
  const MutexLock lock(mutex_);
  transports_.insert(&transport);
}

void SharedLcm::remove(publishing::LcmTransport& transport) {
  const MutexLock lock(mutex_);
  transports_.erase(&transport);
}

RobotTransport::RobotTransport(std::shared_ptr<SharedLcm> lcm, std::uint32_t robot, std::optional<access::RobotKey> key,
                               const DeedLog& log)
    : lcm_(std::move(lcm)),
      robot_(robot),
      log_(log),
      lcm_transport_([to = lcm_.get()](const char* channel, const Bytes& message) { to->publish(channel, message); },
                     /*local=*/false, {key}) {}

void RobotTransport::send(const KeyframePart& part) {
  *sent_bytes_ += part.data.size();
  lcm_transport_.send(part);
}

void RobotTransport::listen(Listener listener) {
  auto hear = std::move(listener.acknowledged);
  listener.acknowledged = [this, hear = std::move(hear)](const Acknowledgement& ack) {
    if (ack.session == session_ && ack.next_sequence > acknowledged_) {
      acknowledged_ = ack.next_sequence;
      log_.add({Deed::Kind::kAcknowledged, robot_, acknowledged_, *sent_bytes_, monotonic_ns()});
    }
    hear(ack);
  };
  lcm_transport_.listen(std::move(listener));
  lcm_->add(lcm_transport_);
}

void RobotTransport::stop() {
  lcm_->remove(lcm_transport_);
  lcm_transport_.stop();
}

}  // namespace relmap::bench
