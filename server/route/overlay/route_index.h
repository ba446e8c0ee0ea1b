// The cells of a live map. A thread makes them, and makes them anew where the map changes, while robots drive and
// operators ask for routes.
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
  std::string folder;                 // the data folder; empty: cells are in an unnamed file
  std::uint64_t room_for_others = 0;  // bytes of the disk that cells leave free
  // The metrics by which routes may be asked for. Each takes additional room.
  std::vector<RouteWeights> metrics{kByDistance, kByTime};
  // The share of one processor's time that the thread may take while the map changes.
  double work_share = 0.2;
  std::size_t chunks_at_once = 256;  // chunks that are made anew before the result is shown
  // Pause before the next try if cells have no room or the map cannot be read. It doubles with each failure.
  std::chrono::milliseconds retry{60'000};
};

// Thread-safe.
class RouteIndex {
 public:
  using CurrentView = std::function<std::shared_ptr<const storage::MapView>()>;
  // Memory is charged to Share::kRoutes. If the budget has no room even for what is outside the store, if other shares
  // need the memory, or if the disk is full, there are no cells for a while, and snapshot() says why.
  RouteIndex(RouteIndexOptions options, CurrentView view, std::shared_ptr<storage::Budget> budget);
  ~RouteIndex();
  RouteIndex(const RouteIndex&) = delete;
  RouteIndex& operator=(const RouteIndex&) = delete;

  // Starts the thread, with the map that `view` returns then, and with the cells that save() left if the map is still
  // the same. changed() must be called from before start() on, for every edit since the map was opened.
  void start();
  // Ends the thread. changed() must still be called for later edits.
  void stop();
  // Saves the cells for the next run. Call it after stop(), when the map is committed as the newest view shows it and
  // does not change any more. IO_ERROR, DISK_FULL: the next run makes cells anew.
  Status save() const;

  // Tells that frames of these chunks change in the view of this version, which nobody has yet (Map::watch_edits).
  // Takes microseconds.
  void changed(std::uint64_t version, std::span<const storage::ChunkId> chunks);

  // What a search uses: a view, cells, and the chunks in which the view differs from what the cells were made of.
  struct Snapshot {
    std::shared_ptr<const storage::MapView> view;
    std::shared_ptr<const Overlay> overlay;  // null if there are no cells
    std::string missing_because;             // why there are no cells
    std::string late_because;                // why cells are not made anew at present; empty if they are
    std::vector<storage::ChunkId> stale;
  };
  // The newest view and cells.
  Snapshot snapshot() const;

  // Waits until the index is current: the cells contain all of the map and none is outdated. Also returns if there are
  // no cells, or none are made anew, for a while. False if the deadline passed first. For tests and benchmarks.
  bool wait_current(std::chrono::steady_clock::time_point deadline) const;

 private:
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::route
