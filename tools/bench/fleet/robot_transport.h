// The transports of robots over a shared connection, which log what is sent and heard.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "frontend/publishing/lcm/lcm_transport.h"
#include "proto/base/mutex.h"
#include "proto/wire/lcm_link.h"
#include "tools/bench/fleet/deeds.h"

namespace relmap::bench {

// One LCM connection for the publishers of many robots, since each connection receives the messages for all of them.
class SharedLcm {
 public:
  static std::shared_ptr<SharedLcm> open(const std::string& url);  // throws

  void publish(const char* channel, const Bytes& message) { link_->publish(channel, message); }
  // The transport hears everything from now on, or nothing more: then it is not called any more when this returns.
  void add(publishing::LcmTransport& transport);
  void remove(publishing::LcmTransport& transport);

 private:
  SharedLcm() = default;

  Mutex mutex_;  // transports are called under it
  std::set<publishing::LcmTransport*> transports_ RELMAP_GUARDED_BY(mutex_);
  std::unique_ptr<LcmLink> link_;
};

class RobotTransport final : public publishing::PublishTransport {
 public:
  // `key`: seals what is sent. `log` outlives it.
  RobotTransport(std::shared_ptr<SharedLcm> lcm, std::uint32_t robot, std::optional<access::RobotKey> key,
                 const DeedLog& log);
  ~RobotTransport() override { stop(); }

  void send(const KeyframePart& part) override;
  void send(const Gap& gap) override { lcm_transport_.send(gap); }
  void send(const SessionEnd& end) override { lcm_transport_.send(end); }
  void sends_for(const SessionUuid& session, const Uuid& map) override {
    session_ = session;
    lcm_transport_.sends_for(session, map);
  }
  void listen(Listener listener) override;
  void stop() override;

  // Of keyframes, in parts, until now. Outlives the publisher that owns the transport.
  std::shared_ptr<const std::atomic<std::uint64_t>> sent_bytes() const { return sent_bytes_; }

 private:
  const std::shared_ptr<SharedLcm> lcm_;
  const std::uint32_t robot_;
  const DeedLog& log_;
  const std::shared_ptr<std::atomic<std::uint64_t>> sent_bytes_ = std::make_shared<std::atomic<std::uint64_t>>(0);
  SessionUuid session_;
  std::uint64_t acknowledged_ = 0;  // of the connection's thread
  publishing::LcmTransport lcm_transport_;
};

}  // namespace relmap::bench
