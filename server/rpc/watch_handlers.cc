#include "relmap/v1/watch.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/map_watch.h"
#include "storage/events/event_log.h"

namespace relmap::rpc {

Result<LiveProducer<v1::MapEvent>> watch_map(const v1::WatchMapRequest& request, const Deadline&, map::Mapper& mapper,
                                             WatchFeed& feed) {
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
