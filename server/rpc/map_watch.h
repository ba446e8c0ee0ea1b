// One watcher of the map: reads the committed log of events by itself, from its own position, and turns what it finds
// into messages. It holds no snapshot between two messages, and one read of the log at most. Internal to server/rpc,
// since it exposes generated code.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "proto/base/map_identity.h"
#include "relmap/v1/watch.pb.h"
#include "server/rpc/producer.h"
#include "server/rpc/watch_feed.h"
#include "storage/events/event_log.h"

namespace relmap::rpc {

// How the log is read, each time as it is committed then.
struct EventReader {
  std::function<Result<storage::EventsRead>(storage::EventPosition after, std::size_t max_bytes)> read;
  std::function<Result<storage::EventPosition>()> newest;
};

class MapWatch {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kHeartbeat{14};  // so that 15 s is kept
  static constexpr int kMaxFrames = 256;                 // of a message, or ranges of frames moved
  static constexpr std::size_t kReadBytes = 32 << 10;    // of the log, at a time; decoded some 300 kB

  // Where the request says that it begins. INVALID_ARGUMENT; IO_ERROR, DATA_LOSS of the log. `feed` must outlive it.
  static Result<std::shared_ptr<MapWatch>> begin(const v1::WatchMapRequest& request, const MapIdentity& map,
                                                 EventReader log, WatchFeed& feed);

  // The next message, or until when there is none. `wake` is used until the object is destroyed.
  Result<Next<v1::MapEvent>> next(const Wake& wake, Clock::time_point now);

 private:
  MapWatch(const v1::WatchMapRequest& request, const MapIdentity& map, EventReader log, WatchFeed& feed);

  Result<storage::EventPosition> now() const;
  Status go_on_from_now(Reason reason, std::string message, std::uint64_t missed_after);
  void tell_changes(WatchFeed::Changes changes);
  Status read();
  std::optional<v1::MapEvent> take_event();
  bool wants(SessionNumber session) const { return sessions_.empty() || sessions_.contains(session); }
  bool wants(const storage::EventContent& content) const;
  v1::MapEvent take_frames();
  std::optional<v1::MapEvent> take_moved();
  void told();
  v1::MapEvent caught_up(Clock::time_point now);
  std::string token() const;

  const MapIdentity map_;
  const EventReader log_;
  WatchFeed& feed_;
  const std::set<SessionNumber> sessions_;
  const bool no_frames_;
  storage::EventPosition at_;          // everything up to here was told
  std::deque<v1::MapEvent> first_;     // before events of the log, without a token
  std::deque<storage::Event> events_;  // read, and not told yet
  storage::EventPosition through_;     // where to read on behind these
  std::size_t ranges_told_ = 0;        // of the first of these, if it is frames moved
  bool more_ = true;                   // the log may have more than these
  Committed committed_;                // at the last look
  std::uint64_t read_commit_ = 0;      // whose log was read
  bool moved_ = true;                  // since the watcher was last told that it has caught up
  Clock::time_point heartbeat_;        // when it is told so at the latest
  std::unique_ptr<WatchFeed::Subscription> subscription_;
};

}  // namespace relmap::rpc
