// The transport of a robot over a shared connection, which logs what is sent and heard.
#pragma once

#include <atomic>
#include <memory>

#include "tools/bench/fleet/deeds.h"
#include "tools/bench/fleet/shared_lcm.h"

namespace relmap::bench {

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
