// The callbacks that are told what the worker changed: one for closures, one for edits, one for commits.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <unordered_set>

#include "proto/base/mutex.h"
#include "server/map/closures.h"
#include "storage/map/map.h"

namespace relmap::map {

// Thread-safe: watch() by any thread, announce() by the worker.
class ClosureAnnouncer {
 public:
  using Watcher = std::function<void(const storage::Graph& map, const storage::Edge& closure)>;
  // Replaces the watcher; an empty function unregisters it. When this returns, the previous watcher is no longer
  // running.
  void watch(Watcher watcher);

  // Tells the watcher of every closure that became a lone candidate, came into force, was taken out or was deleted with
  // a session, as `view` has it. Exceptions of the watcher are logged and not passed on.
  void announce(const storage::Graph& view, const ClosureChange& closures);

 private:
  Mutex mutex_;
  Watcher watcher_ RELMAP_GUARDED_BY(mutex_);
};

// Thread-safe: watch() by any thread, edited() by the worker.
class EditAnnouncer {
 public:
  using Watcher = storage::Map::EditWatcher;
  // Replaces the watcher; an empty function unregisters it. When this returns, the previous watcher is no longer
  // running. The first watcher is told at once, by the caller's thread, of everything edited before. Returns the
  // version of the newest edit; the caller must wait until the map's view has reached it before it takes a view.
  std::uint64_t watch(Watcher watcher);

  // Tells the watcher that the hot parts of these chunks differ in view `version`, which is not published yet.
  void edited(std::uint64_t version, std::span<const storage::ChunkId> chunks);

 private:
  Mutex mutex_;
  Watcher watcher_ RELMAP_GUARDED_BY(mutex_);
  bool watched_ RELMAP_GUARDED_BY(mutex_) =
      false;  // there has been a watcher: edits are no longer kept for a later one
  std::uint64_t version_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::unordered_set<storage::ChunkId> untold_ RELMAP_GUARDED_BY(mutex_);
};

// Thread-safe: watch() by any thread, announce() by the worker.
class CommitAnnouncer {
 public:
  using Watcher = std::function<void()>;
  // Replaces the watcher; an empty function unregisters it. When this returns, the previous watcher is no longer
  // running.
  void watch(Watcher watcher);

  // Tells the watcher that a commit has succeeded. Exceptions of the watcher are logged and not passed on.
  void announce();

 private:
  Mutex mutex_;
  Watcher watcher_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::map
