// Who is logged in. A browser shows an id that means something to this console only: its cookie goes to every server of
// the host, whatever its port, and so must not be the daemon's token.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "proto/base/mutex.h"

namespace relmap::console {

// Thread-safe.
class BrowserSessions {
 public:
  using Clock = std::chrono::steady_clock;
  struct Limits {
    std::size_t most = 4096;
    Clock::duration idle = std::chrono::hours(12);  // a session that is not used for so long has ended
  };
  BrowserSessions() = default;
  explicit BrowserSessions(Limits limits) : limits_(limits) {}

  // Begins a session of whoever has this token, and returns its id: 64 hexadecimal digits. If there are too many, the
  // one of the same token ends that was not used for longest, or if it has none, that of all.
  std::string begin(std::string token, Clock::time_point now);
  // The token of this session, which is used with this; nullopt: there is none.
  std::optional<std::string> use(std::string_view id, Clock::time_point now);
  void end(std::string_view id);
  void end_all_of(std::string_view token);
  // The token of the session that has begun last; nullopt: there is none.
  std::optional<std::string> newest(Clock::time_point now) const;

  std::size_t size() const;

 private:
  struct Session {
    std::string token;
    std::uint64_t number = 0;  // of those that have begun
    Clock::time_point used;
  };
  void make_room(const std::string& token, Clock::time_point now) RELMAP_REQUIRES(mutex_);

  const Limits limits_ = {};
  mutable Mutex mutex_;
  std::uint64_t begun_ RELMAP_GUARDED_BY(mutex_) = 0;
  // By the hash of the id, so that how long a search takes tells nothing of an id.
  std::map<std::string, Session> sessions_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::console
