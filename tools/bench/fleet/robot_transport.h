// The transports of robots over a shared connection, which log what is sent and heard.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>

#include "frontend/publishing/publish_transport.h"
#include "proto/base/mutex.h"
#include "proto/wire/lcm_link.h"
#include "tools/bench/fleet/deeds.h"

namespace relmap::bench {

// One LCM connection for the publishers of many robots, since each connection receives the messages for all of them.
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

class RobotTransport final : public publishing::PublishTransport {
 public:
  // `log` outlives it.
  RobotTransport(std::shared_ptr<SharedLcm> lcm, const SessionUuid& session, std::uint32_t robot, const DeedLog& log);
  ~RobotTransport() override { stop(); }

  void send(const KeyframePart& part) override;
  void send(const Gap& gap) override;
  void send(const SessionEnd& end) override;
  void listen(Listener listener) override;
  void stop() override { lcm_->listen(session_, {}); }

  // Of keyframes, in parts, until now. Outlives the publisher that owns the transport.
  std::shared_ptr<const std::atomic<std::uint64_t>> sent_bytes() const { return sent_bytes_; }

 private:
  const std::shared_ptr<SharedLcm> lcm_;
  const SessionUuid session_;
  const std::uint32_t robot_;
  const DeedLog& log_;
  const std::shared_ptr<std::atomic<std::uint64_t>> sent_bytes_ = std::make_shared<std::atomic<std::uint64_t>>(0);
  std::uint64_t acknowledged_ = 0;  // of the connection's thread
};

}  // namespace relmap::bench
