// An adversary (adversary.h) on a multicast group of LCM.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include "proto/base/mutex.h"
#include "proto/wire/lcm_link.h"
#include "tests/support/adversary.h"

namespace relmap::testing {

// Thread-safe.
class LcmAttacker {
 public:
  // Attacks these sessions, at least one. Throws.
  LcmAttacker(const std::string& url, std::vector<SessionUuid> sessions, std::uint64_t seed);
  ~LcmAttacker() { link_->stop(); }

  // See Adversary.
  void use(const access::RobotKey& own);
  // Sends one datagram.
  void forge();

  std::size_t sent() const { return sent_; }
  std::size_t sealed() const;  // of these, by its own key
  std::size_t heard() const;   // datagrams of others that it can use

 private:
  void hear(const char* channel, ByteSpan datagram);

  std::atomic<std::size_t> sent_ = 0;
  mutable Mutex mutex_;
  Adversary adversary_ RELMAP_GUARDED_BY(mutex_);
  // Checksums of what it has sent and not heard yet: LCM hears what it sends itself.
  std::unordered_multiset<std::uint32_t> echoes_ RELMAP_GUARDED_BY(mutex_);
  std::unique_ptr<LcmLink> link_;
};

}  // namespace relmap::testing
