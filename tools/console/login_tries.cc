#include "tools/console/login_tries.h"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/network_v6.hpp>

namespace relmap::console {

namespace {

constexpr std::chrono::minutes kRemembered{1};

}  // namespace

std::string network_of(const std::string& address) {
  namespace ip = boost::asio::ip;
  boost::system::error_code error;
  const ip::address parsed = ip::make_address(address, error);
  if (error || parsed.is_v4()) return address;
  const ip::address_v6 v6 = parsed.to_v6();
  if (v6.is_v4_mapped()) return ip::make_address_v4(ip::v4_mapped, v6).to_string();
  return ip::make_network_v6(v6, 64).canonical().to_string();
}

Status LoginTries::begin(const std::string& address, const std::string& hash, Clock::time_point now) {
  const std::string network = network_of(address);
  const MutexLock lock(mutex_);
  if (failures_.size() >= kMaxAddresses && !failures_.contains(network)) make_room(now);
  Failures& own = failures_[network];
  std::erase_if(own, [&](const auto& one) { return now - one.first > kRemembered; });
  const bool again = std::any_of(own.begin(), own.end(), [&](const auto& one) { return one.second == hash; });
  if (own.size() >= kMaxFailures)
    return {Reason::RATE_LIMITED, "too many logins from this address have failed: wait a minute"};
  if (!again) own.emplace_back(now, hash);
  return {};
}

void LoginTries::succeeded(const std::string& address, const std::string& hash) {
  const MutexLock lock(mutex_);
  const auto own = failures_.find(network_of(address));
  if (own == failures_.end()) return;
  std::erase_if(own->second, [&](const auto& one) { return one.second == hash; });
  if (own->second.empty()) failures_.erase(own);
}

std::size_t LoginTries::addresses() const {
  const MutexLock lock(mutex_);
  return failures_.size();
}

void LoginTries::make_room(Clock::time_point now) {
  std::erase_if(failures_, [&](const auto& one) { return now - one.second.back().first > kRemembered; });
  if (failures_.size() < kMaxAddresses) return;
  const auto fails_less = [](const auto& a, const auto& b) { return a.second.back().first < b.second.back().first; };
  failures_.erase(std::min_element(failures_.begin(), failures_.end(), fails_less));
}

}  // namespace relmap::console
