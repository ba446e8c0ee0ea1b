// Counts failed tries to log in, so that nobody can make many.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::console {

// Thread-safe.
class LoginTries {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMaxFailures = 10;  // of an address within a minute
  static constexpr std::size_t kMaxAddresses = 10'000;

  // A try from this address with what has this hash counts as failed until succeeded() is called. The same thing tried
  // again counts once: a page whose token was revoked asks with it every second, and its owner has to be able to log in
  // again. RATE_LIMITED: the address has failed with too many.
  Status begin(const std::string& address, const std::string& hash, Clock::time_point now);
  void succeeded(const std::string& address, const std::string& hash);

  std::size_t addresses() const;

 private:
  using Failures = std::vector<std::pair<Clock::time_point, std::string>>;  // the oldest first, never empty
  void make_room(Clock::time_point now) RELMAP_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<std::string, Failures> failures_ RELMAP_GUARDED_BY(mutex_);  // by network_of()
};

// Who is counted as one: an IPv4 address, or the first 64 bits of one of IPv6, since whoever has one there has all.
std::string network_of(const std::string& address);

}  // namespace relmap::console
