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
#include "storage/budget.h"
#include "storage/map.h"

namespace relmap {

struct RouteIndexOptions {
  std::string folder;  // of the map; empty: cells stand in a file without a name
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
  using CurrentView = std::function<std::shared_ptr<const MapView>()>;
  // Bytes are Share::kRoutes. Where not even what stands beside the store has room, or other shares need it, or the
  // disk is full, there are no cells for a while, and snapshot() says so.
  RouteIndex(RouteIndexOptions options, CurrentView view, std::shared_ptr<Budget> budget);
  ~RouteIndex();
  RouteIndex(const RouteIndex&) = delete;
  RouteIndex& operator=(const RouteIndex&) = delete;

  // Begins in a thread of its own, with the map that `view` gives then. From before it on, changed() is to be called.
  void start();

  // Frames of these chunks are others in the view of this version, which nobody has yet (Map::watch_edits). Takes
  // microseconds.
  void changed(std::uint64_t version, std::span<const ChunkId> chunks);

  // What a search stands on: cells, and where the view is no longer what they were made of.
  struct Snapshot {
    std::shared_ptr<const MapView> view;
    std::shared_ptr<const Overlay> overlay;  // null: there are no cells,
    std::string missing_because;             // and why
    std::vector<ChunkId> stale;
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

}  // namespace relmap
