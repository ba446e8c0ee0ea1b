// The connections that are open, over which known callers have called, and which must make room for others. gRPC would
// keep a connection for ever over which a request is half sent, and limits no number of connections.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::rpc {

struct ConnectionLimits {
  std::size_t total = 1024;    // over TCP; as many again over the Unix socket
  std::size_t per_peer = 256;  // from one address, over TCP
  // A connection over TCP is closed over which no known caller has had a call for so long. gRPC closes one without any
  // call a minute before.
  double quiet_s = 660;
  Status lowered = {};  // TOO_MANY_FILES: why `total` is less than was configured
};

struct ConnectionCounts {
  std::size_t open = 0;
  std::uint64_t refused = 0, displaced = 0;  // since the start; displaced: closed to make room
  Status trouble;                            // not ok: fewer connections are taken than was configured
};

// Thread-safe. Connections are closed by shutdown(2) alone: whoever has taken a descriptor over closes it.
class Connections {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Connections(const ConnectionLimits& limits) : limits_(limits) {}

  // Counts an open connection, which somebody else is about to take over. If there are as many as may be, the oldest
  // over which no known caller has called is closed to make room; if there is none, the connection is not counted.
  enum class Added { kYes, kRoomMade, kNo };
  Added add(int connection);
  // A call of a known caller begins or has ended over the connection of `peer`, as gRPC names it.
  void call_begins(const std::string& peer);
  void call_ends(const std::string& peer);
  // Closes those that have been quiet for too long at `now`.
  void close_quiet(Clock::time_point now);

  // Notes that a connection could not be accepted at `now`. Told by counts() for a minute.
  void not_accepted(const Status& why, Clock::time_point now);

  ConnectionCounts counts(Clock::time_point now) const;
  const ConnectionLimits& limits() const { return limits_; }

 private:
  struct Open {
    std::pair<dev_t, ino_t> file;
    std::string source;       // the address that is counted; empty: a Unix socket
    std::string peer;         // address and port
    Clock::time_point since;  // the last call of a known caller, or the beginning
    bool known = false;
    int calls = 0;
  };
  using Entry = std::map<int, Open>::iterator;

  bool has_room(const std::string& source) const RELMAP_REQUIRES(mutex_);
  bool make_room(const std::string& source) RELMAP_REQUIRES(mutex_);
  void forget_closed() RELMAP_REQUIRES(mutex_);
  Entry forget(Entry entry) RELMAP_REQUIRES(mutex_);
  Entry shut(Entry entry) RELMAP_REQUIRES(mutex_);
  Open* find(const std::string& peer) RELMAP_REQUIRES(mutex_);

  const ConnectionLimits limits_;
  mutable Mutex mutex_;
  std::map<int, Open> open_ RELMAP_GUARDED_BY(mutex_);                      // by descriptor
  std::map<std::string, std::size_t> by_source_ RELMAP_GUARDED_BY(mutex_);  // how many of them
  std::map<std::string, int> by_peer_ RELMAP_GUARDED_BY(mutex_);            // descriptors; of TCP only
  std::uint64_t refused_ RELMAP_GUARDED_BY(mutex_) = 0, displaced_ RELMAP_GUARDED_BY(mutex_) = 0;
  Status not_accepted_ RELMAP_GUARDED_BY(mutex_);
  Clock::time_point not_accepted_at_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::rpc
