// The cells of a live map: a thread makes them, and makes them anew where the map changes, while robots drive and
// operators ask.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/route/overlay/overlay.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::route {

struct RouteIndexOptions {
  std::string folder;                 // of the map; empty: cells stand in a file without a name
  std::uint64_t room_for_others = 0;  // bytes of the disk that cells leave free
  // What routes may be asked for by. Each takes room of its own.
  std::vector<RouteWeights> metrics{kByDistance, kByTime};
  // Share of one processor's time that the thread may take while the map changes.
  double work_share = 0.2;
  std::size_t chunks_at_once = 256;  // made anew before that is shown
  std::chrono::milliseconds retry{
      60'000};  // after cells found no room, or the map could not be read; then twice as long
};

// Thread-safe.
class RouteIndex {
 public:
  using CurrentView = std::function<std::shared_ptr<const storage::MapView>()>;
  // Bytes are Share::kRoutes. Where not even what stands beside the store has room, or other shares need it, or the
  // disk is full, there are no cells for a while, and snapshot() says so.
  RouteIndex(RouteIndexOptions options, CurrentView view, std::shared_ptr<storage::Budget> budget);
  ~RouteIndex();
  RouteIndex(const RouteIndex&) = delete;
  RouteIndex& operator=(const RouteIndex&) = delete;

  // Begins in a thread of its own, with the map that `view` gives then, and with the cells that save() left if that is
  // the map still. From before it on, changed() is to be called: of all that is edited since the map was opened.
  void start();
  // Ends the thread; changed() is still to be called.
  void stop();
  // For the next run, when the map is committed as the newest view shows it, and will not change any more; after
  // stop(). IO_ERROR, DISK_FULL: the next run makes cells anew.
  Status save() const;

  // Frames of these chunks are others in the view of this version, which nobody has yet (Map::watch_edits). Takes
  // microseconds.
  void changed(std::uint64_t version, std::span<const storage::ChunkId> chunks);

  // What a search stands on: cells, and where the view is no longer what they were made of.
  struct Snapshot {
    std::shared_ptr<const storage::MapView> view;
    std::shared_ptr<const Overlay> overlay;  // null: there are no cells,
    std::string missing_because;             // and why
    std::string late_because;                // not empty: why cells are not made anew at present
    std::vector<storage::ChunkId> stale;
  };
  // The newest.
  Snapshot snapshot() const;

  // Until the cells know all of the map, and none is outdated, or there are none for a while; false: not by then. For
  // tests and benchmarks.
  bool wait_settled(std::chrono::steady_clock::time_point deadline) const;

 private:
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::route
