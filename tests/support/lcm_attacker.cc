#include "tests/support/lcm_attacker.h"

#include <utility>

#include "proto/base/crc32c.h"
#include "proto/wire/channels.h"

namespace relmap::testing {

LcmAttacker::LcmAttacker(const std::string& url, std::vector<SessionUuid> sessions, std::uint64_t seed)
    : adversary_(std::move(sessions), seed) {
  LcmLink::Handlers handlers;
  for (const char* channel :
       {kKeyframeChannel, kGapChannel, kEndChannel, kHelloChannel, kAckChannel, kPoseChannel, kMapChannel})
    handlers.emplace_back(channel, [this, channel](ByteSpan datagram) { hear(channel, datagram); });
  link_ = LcmLink::open(url, std::move(handlers)).or_throw();
}

void LcmAttacker::use(const access::RobotKey& own) {
  const MutexLock lock(mutex_);
  adversary_.use(own);
}

void LcmAttacker::forge() {
  Adversary::Datagram made;
  {
    const MutexLock lock(mutex_);
    made = adversary_.forge(Adversary::Time::clock::now());
    echoes_.insert(crc32c(made.bytes));
  }
  ++sent_;
  link_->publish(made.channel, made.bytes);
}

void LcmAttacker::hear(const char* channel, ByteSpan datagram) {
  const MutexLock lock(mutex_);
  if (const auto echo = echoes_.find(crc32c(datagram)); echo != echoes_.end())
    echoes_.erase(echo);
  else
    adversary_.hear(channel, datagram, Adversary::Time::clock::now());
}

std::size_t LcmAttacker::sealed() const {
  const MutexLock lock(mutex_);
  return adversary_.sealed();
}

std::size_t LcmAttacker::heard() const {
  const MutexLock lock(mutex_);
  return adversary_.heard();
}

}  // namespace relmap::testing
