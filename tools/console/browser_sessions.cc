#include "tools/console/browser_sessions.h"

#include <algorithm>
#include <utility>

#include "proto/access/token.h"

namespace relmap::console {

std::string BrowserSessions::begin(std::string token, Clock::time_point now) {
  std::string id = access::new_token();
  const MutexLock lock(mutex_);
  if (sessions_.size() >= limits_.most) make_room(token, now);
  sessions_[access::sha256(id)] = {std::move(token), ++begun_, now};
  return id;
}

std::optional<std::string> BrowserSessions::use(std::string_view id, Clock::time_point now) {
  const std::string hash = access::sha256(id);
  const MutexLock lock(mutex_);
  const auto found = sessions_.find(hash);
  if (found == sessions_.end()) return {};
  if (now - found->second.used > limits_.idle) {
    sessions_.erase(found);
    return {};
  }
  found->second.used = now;
  return found->second.token;
}

void BrowserSessions::end(std::string_view id) {
  const std::string hash = access::sha256(id);
  const MutexLock lock(mutex_);
  sessions_.erase(hash);
}

void BrowserSessions::end_all_of(std::string_view token) {
  const MutexLock lock(mutex_);
  std::erase_if(sessions_, [&](const auto& one) { return one.second.token == token; });
}

std::optional<std::string> BrowserSessions::newest(Clock::time_point now) const {
  const MutexLock lock(mutex_);
  const Session* newest = nullptr;
  for (const auto& [hash, session] : sessions_)
    if (now - session.used <= limits_.idle && (!newest || session.number > newest->number)) newest = &session;
  if (!newest) return {};
  return newest->token;
}

std::size_t BrowserSessions::size() const {
  const MutexLock lock(mutex_);
  return sessions_.size();
}

void BrowserSessions::make_room(const std::string& token, Clock::time_point now) {
  std::erase_if(sessions_, [&](const auto& one) { return now - one.second.used > limits_.idle; });
  if (sessions_.size() < limits_.most) return;
  const auto goes_before = [&](const auto& a, const auto& b) {
    const bool own_a = a.second.token == token, own_b = b.second.token == token;
    return own_a != own_b ? own_a : a.second.used < b.second.used;
  };
  sessions_.erase(std::min_element(sessions_.begin(), sessions_.end(), goes_before));
}

}  // namespace relmap::console
