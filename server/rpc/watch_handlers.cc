#include "relmap/v1/watch.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/limits.h"
#include "server/rpc/map_watch.h"
#include "storage/events/event_log.h"

namespace relmap::rpc {

namespace {

// A watch that is resumed may name sessions that have been deleted since: it is told of that.
Status check_sessions(const v1::WatchMapRequest& request, const storage::Graph& map) {
  if (request.sessions_size() > kMaxNamedSessions)
    return {Reason::INVALID_ARGUMENT, "more than " + std::to_string(kMaxNamedSessions) + " sessions"};
  if (!request.resume_token().empty()) return {};
  for (const SessionNumber number : request.sessions())
    if (const auto session = storage::existing_session(map, number); !session.ok()) return session.status();
  return {};
}

}  // namespace

Result<LiveProducer<v1::MapEvent>> watch_map(const v1::WatchMapRequest& request, const Deadline&, map::Mapper& mapper,
                                             WatchFeed& feed) {
  if (Status named = check_sessions(request, *mapper.view()); !named.ok()) return named;
  storage::Engine& engine = mapper.engine();
  EventReader log{[&engine](storage::EventPosition after, std::size_t max_bytes) {
                    return storage::read_events(*engine.snapshot(), after, max_bytes);
                  },
                  [&engine] { return storage::newest_event(*engine.snapshot()); }};
  auto watch = MapWatch::begin(request, mapper.identity(), std::move(log), feed);
  if (!watch.ok()) return watch.status();
  return LiveProducer<v1::MapEvent>(
      [watch = std::move(*watch)](const Wake& wake) { return watch->next(wake, MapWatch::Clock::now()); });
}

}  // namespace relmap::rpc
