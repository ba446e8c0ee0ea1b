#include "server/map/watchers.h"

#include <spdlog/spdlog.h>

#include <exception>
#include <utility>
#include <vector>

#include "proto/base/mutex.h"

namespace relmap::map {

void ClosureAnnouncer::watch(Watcher watcher) {
  const MutexLock lock(mutex_);
  watcher_ = std::move(watcher);
}

void ClosureAnnouncer::announce(const storage::Graph& view, const ClosureChange& closures) {
  if (closures.accepted.empty() && closures.out_of_force.empty() && closures.lone.empty() && closures.gone.empty())
    return;
  const MutexLock lock(mutex_);
  if (!watcher_) return;
  for (const auto& ids : {closures.lone, closures.accepted, closures.out_of_force})
    for (const EdgeId id : ids) try {
        watcher_(view, *view.hot(id.frame)->edge(id));
      } catch (const std::exception& error) {
        spdlog::warn("closure {} is not announced: {}", id.to_string(), error.what());
      }
  for (const storage::Edge& edge : closures.gone) try {
      watcher_(view, edge);
    } catch (const std::exception& error) {
      spdlog::warn("that closure {} is gone is not announced: {}", edge.id.to_string(), error.what());
    }
}

std::uint64_t EditAnnouncer::watch(Watcher watcher) {
  const MutexLock lock(mutex_);
  watcher_ = std::move(watcher);
  watched_ = true;
  const std::vector<storage::ChunkId> untold(untold_.begin(), untold_.end());
  untold_.clear();
  if (watcher_ && !untold.empty()) watcher_(version_, untold);
  return version_;
}

void EditAnnouncer::edited(std::uint64_t version, std::span<const storage::ChunkId> chunks) {
  const MutexLock lock(mutex_);
  version_ = version;
  if (watcher_)
    watcher_(version, chunks);
  else if (!watched_)
    untold_.insert(chunks.begin(), chunks.end());
}

void CommitAnnouncer::watch(Watcher watcher) {
  const MutexLock lock(mutex_);
  watcher_ = std::move(watcher);
}

void CommitAnnouncer::announce() {
  const MutexLock lock(mutex_);
  if (!watcher_) return;
  try {
    watcher_();
  } catch (const std::exception& error) {
    spdlog::warn("a commit is not announced: {}", error.what());
  }
}

}  // namespace relmap::map
