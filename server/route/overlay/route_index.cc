#include "server/route/overlay/route_index.h"

#include <sys/resource.h>

#include <algorithm>
#include <thread>
#include <unordered_map>
#include <utility>

#include "proto/base/mutex.h"
#include "server/route/overlay/overlay_table.h"

namespace relmap::route {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kSlice{10};  // time for making outdated cells before the result is shown
constexpr std::chrono::milliseconds kMaxRest{1000};
constexpr std::chrono::hours kLastRetry{1};

}  // namespace

struct RouteIndex::Impl {
  Impl(RouteIndexOptions o, CurrentView v, std::shared_ptr<storage::Budget> b)
      : options(std::move(o)), current_view(std::move(v)), budget(std::move(b)), working(options.metrics, nullptr) {
    budget->add_evictor(this, [this] { yield(); });
  }
  ~Impl() { budget->remove_evictor(this); }

  void run();
  void load();
  bool work();
  void open_store();
  void build(const storage::MapView& view);
  std::vector<storage::ChunkId> refresh(const storage::MapView& view, const std::vector<storage::ChunkId>& chunks);
  bool is_mostly_new(const std::vector<storage::ChunkId>& chunks) const;
  void show(std::uint64_t version, const std::vector<storage::ChunkId>& known);
  void drop(const std::string& why, bool for_a_while);
  void make_room();
  void yield();
  void charge(std::size_t bytes);
  void check(std::size_t bytes) const;
  std::shared_ptr<CellStore> current_store() const {
    const MutexLock lock(mutex);
    return store;
  }
  bool shows_cells() const {
    const MutexLock lock(mutex);
    return shown != nullptr;
  }
  void note_late(const std::string& why) {
    const MutexLock lock(mutex);
    late_because = why;
  }

  const RouteIndexOptions options;
  const CurrentView current_view;
  const std::shared_ptr<storage::Budget> budget;
  // Used by the thread only:
  Overlay working;
  bool hindered = false;    // something could not be read
  std::size_t charged = 0;  // bytes charged for what is outside the store
  Clock::time_point damaged_at{};

  mutable Mutex mutex;
  mutable ConditionVariable wake;
  std::shared_ptr<CellStore> store RELMAP_GUARDED_BY(mutex);  // null until it has been opened
  std::unordered_map<storage::ChunkId, std::uint64_t> stale
      RELMAP_GUARDED_BY(mutex);                                   // the version of the last change of each stale chunk
  std::shared_ptr<const Overlay> shown RELMAP_GUARDED_BY(mutex);  // null while there are no cells
  std::string missing_because RELMAP_GUARDED_BY(mutex) = "the cells of this map are still being made";
  std::string late_because RELMAP_GUARDED_BY(mutex);
  bool given_up RELMAP_GUARDED_BY(mutex) = false;  // until the next retry
  bool must_yield RELMAP_GUARDED_BY(mutex) = false;
  bool stopping RELMAP_GUARDED_BY(mutex) = false;
  std::thread thread;
};

void RouteIndex::Impl::run() {
  ::setpriority(PRIO_PROCESS, 0, 10);  // lowers the priority of this thread: robots and callers come first
  Clock::duration retry = options.retry;
  load();
  MutexLock lock(mutex);
  while (!stopping) {
    lock.unlock();
    const auto start = Clock::now();
    bool more = true;
    Status trouble;
    try {
      more = work();
    } catch (const std::exception&) {
      trouble = caught_status();
    }
    Clock::duration pause;
    if (trouble.ok()) {
      retry = options.retry;
      note_late("");
      const auto share = (Clock::now() - start) * (1 / options.work_share - 1);
      pause = std::min<Clock::duration>(std::chrono::duration_cast<Clock::duration>(share), kMaxRest);
      if (std::exchange(hindered, false)) pause = kMaxRest;
    } else if (const auto cells = current_store(); cells && cells->is_damaged() && start - damaged_at > options.retry) {
      damaged_at = start;
      drop(trouble.message(), false);  // they are made anew at once, in another file
      pause = {};
    } else {
      // If only the disk is full, the cells that exist are still used, and stale chunks are searched frame by frame.
      if (shows_cells() && trouble.reason() == Reason::DISK_FULL)
        note_late(trouble.message());
      else
        drop(trouble.message(), true);  // the overlay may be half changed
      if (cells) cells->trim();
      pause = retry;
      retry = std::min<Clock::duration>(2 * retry, kLastRetry);
    }
    lock.lock();
    wake.notify_all();
    wake.wait_for(mutex, pause, [&]() RELMAP_REQUIRES(mutex) { return stopping || (must_yield && !given_up); });
    const auto called = [this]() RELMAP_REQUIRES(mutex) {
      return stopping || must_yield || !stale.empty() || store->is_damaged();
    };
    while (!more && !wake.wait_for(mutex, kMaxRest, called)) {
    }
  }
}

// Loads the cells that the run before saved.
void RouteIndex::Impl::load() {
  if (options.folder.empty()) return;
  try {
    auto table = take_table(options.folder, current_view()->committed()->commit_number(), options.metrics, budget,
                            options.room_for_others);
    if (!table) return;
    working = std::move(table->overlay);
    working.note_gone(*current_view());
    {
      const MutexLock lock(mutex);
      store = working.store();
      for (const storage::ChunkId chunk : table->stale) stale.try_emplace(chunk, 0);
    }
    show(0, {});
  } catch (const std::exception&) {
    drop("the cells of this map are still being made", false);
  }
}

void RouteIndex::Impl::open_store() {
  if (const auto cells = current_store(); cells && !cells->is_damaged()) return;
  auto opened = options.folder.empty() ? CellStore::open_temporary(budget)
                                       : CellStore::open(options.folder, budget, options.room_for_others);
  const MutexLock lock(mutex);
  store = std::move(opened).or_throw();
}

// Does some of the work that there is to do. Returns whether there is more.
bool RouteIndex::Impl::work() {
  const bool shows = shows_cells();
  if (shows && current_store()->is_damaged())
    throw StatusError(Status(Reason::DATA_LOSS, "the file of cells is damaged; they are made again from the map"));
  std::vector<storage::ChunkId> chunks;
  std::shared_ptr<const storage::MapView> view;
  {
    const MutexLock lock(mutex);
    given_up = false;
    if (!shows) must_yield = false;
    view = current_view();
    for (const auto& [chunk, version] : stale) chunks.push_back(chunk);
  }
  if (!shows || is_mostly_new(chunks) || working.is_mostly_gone()) {
    build(*view);
  } else {
    if (chunks.size() > options.chunks_at_once) chunks.resize(options.chunks_at_once);
    chunks = refresh(*view, chunks);
  }
  show(view->version(), chunks);
  view.reset();
  if (working.outdated() > 0) {
    for (const auto start = Clock::now(); Clock::now() - start < kSlice && working.make_next();) {
    }
    show(0, {});
  }
  const MutexLock lock(mutex);
  return working.outdated() > 0 || !stale.empty() || working.is_mostly_gone();
}

// There is room for one set of cells only.
void RouteIndex::Impl::build(const storage::MapView& view) {
  drop("the cells of this map are still being made", false);
  open_store();
  working = Overlay(options.metrics, current_store());
  working.build(view, [this](std::size_t bytes) {
    charge(bytes);
    check(bytes);
    return Status();
  });
}

// Those whose cells were made. One that cannot be read, or whose neighbours cannot, leaves the others nothing to wait
// for.
std::vector<storage::ChunkId> RouteIndex::Impl::refresh(const storage::MapView& view,
                                                        const std::vector<storage::ChunkId>& chunks) {
  const auto try_refresh = [&](std::span<const storage::ChunkId> some) {
    Overlay next = working;
    try {
      next.refresh(view, some);
    } catch (const StatusError& error) {
      if (error.status().reason() == Reason::DISK_FULL || current_store()->is_damaged()) throw;
      hindered = true;
      return false;
    }
    working = std::move(next);
    return true;
  };
  if (try_refresh(chunks)) return chunks;
  std::vector<storage::ChunkId> made;
  for (const storage::ChunkId chunk : chunks) {
    check(charged);
    if (try_refresh(std::span(&chunk, 1))) made.push_back(chunk);
  }
  return made;
}

// Whether so many chunks are new that the tree should be built anew: cells that grow chunk by chunk are as good as
// those that are made together only while they are the smaller part.
bool RouteIndex::Impl::is_mostly_new(const std::vector<storage::ChunkId>& chunks) const {
  const auto fresh = std::count_if(chunks.begin(), chunks.end(), [this](storage::ChunkId chunk) {
    return working.tree().find(chunk) == CellTree::kNone;
  });
  return fresh > 64 && static_cast<std::uint32_t>(fresh) > working.tree().chunks() / 4;
}

// Shows the working overlay to searches. The chunks in `known` are as of this version of the map, so they are no longer
// stale unless they have changed since.
void RouteIndex::Impl::show(std::uint64_t version, const std::vector<storage::ChunkId>& known) {
  const std::size_t bytes = working.memory_bytes();
  charge(bytes);
  check(bytes);
  make_room();
  auto copy = std::make_shared<const Overlay>(working);
  const MutexLock lock(mutex);
  std::swap(shown, copy);
  missing_because.clear();
  for (const storage::ChunkId chunk : known)
    if (const auto at = stale.find(chunk); at != stale.end() && at->second <= version) stale.erase(at);
}

void RouteIndex::Impl::drop(const std::string& why, bool for_a_while) {
  std::shared_ptr<const Overlay> gone;
  {
    const MutexLock lock(mutex);
    std::swap(shown, gone);
    missing_because = why;
    given_up = for_a_while;
    must_yield = false;
  }
  gone.reset();
  working = Overlay(options.metrics, nullptr);
  charge(0);
}

void RouteIndex::Impl::charge(std::size_t bytes) {
  if (bytes > charged)
    budget->charge(storage::Share::kRoutes, bytes - charged);
  else
    budget->release(storage::Share::kRoutes, charged - bytes);
  charged = bytes;
}

// Evicts cells from memory if other shares, or this one, exceed the budget.
void RouteIndex::Impl::make_room() {
  const std::size_t beside = budget->used_beside_cache(), mine = budget->used(storage::Share::kRoutes),
                    allowance = budget->allowance(storage::Share::kRoutes);
  const std::size_t over =
      std::max(beside > budget->limit() ? beside - budget->limit() : 0, mine > allowance ? mine - allowance : 0);
  if (over == 0) return;
  std::shared_ptr<CellStore> cells;
  {
    const MutexLock lock(mutex);
    cells = store;
  }
  if (cells) cells->evict(over);
}

// Called when the budget is exceeded. Frees what can be read again first; if that is not enough, all cells, which can
// be made again.
void RouteIndex::Impl::yield() {
  make_room();
  if (budget->used_beside_cache() <= budget->limit()) return;
  const MutexLock lock(mutex);
  must_yield = true;
  wake.notify_all();
}

void RouteIndex::Impl::check(std::size_t bytes) const {
  const std::size_t allowance = budget->allowance(storage::Share::kRoutes);
  if (bytes > allowance / 2)  // the other half is for the cells that searches pass
    throw StatusError(Status(Reason::BUDGET_EXCEEDED, "the cells of this map take more than the " +
                                                          std::to_string(allowance >> 20) +
                                                          " MB that memory_budget_mb leaves for them"));
  const MutexLock lock(mutex);
  if (must_yield)
    throw StatusError(Status(Reason::BUDGET_EXCEEDED, "the memory of the cells was needed for something else"));
  if (stopping) throw StatusError(Status(Reason::SHUTTING_DOWN, "the daemon stops"));
}

RouteIndex::RouteIndex(RouteIndexOptions options, CurrentView view, std::shared_ptr<storage::Budget> budget)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(view), std::move(budget))) {}

void RouteIndex::start() {
  impl_->thread = std::thread([this] { impl_->run(); });
}

void RouteIndex::stop() {
  {
    const MutexLock lock(impl_->mutex);
    impl_->stopping = true;
    impl_->wake.notify_all();
  }
  if (impl_->thread.joinable()) impl_->thread.join();
}

Status RouteIndex::save() const {
  const Snapshot last = snapshot();
  if (impl_->options.folder.empty() || !last.overlay || last.overlay->store()->is_damaged()) return {};
  return write_table(impl_->options.folder, last.view->committed()->commit_number(), *last.overlay, last.stale);
}

RouteIndex::~RouteIndex() {
  stop();
  impl_->drop("", true);
}

void RouteIndex::changed(std::uint64_t version, std::span<const storage::ChunkId> chunks) {
  const MutexLock lock(impl_->mutex);
  const bool idle = impl_->stale.empty();
  for (const storage::ChunkId chunk : chunks) impl_->stale[chunk] = version;
  if (idle) impl_->wake.notify_all();
}

RouteIndex::Snapshot RouteIndex::snapshot() const {
  const MutexLock lock(impl_->mutex);
  // changed() is called before a view is published, so every chunk in which this view differs from the cells is in
  // `stale`.
  Snapshot snapshot{impl_->current_view(), impl_->shown, impl_->missing_because, impl_->late_because, {}};
  if (!snapshot.overlay) return snapshot;
  snapshot.stale.reserve(impl_->stale.size());
  for (const auto& [chunk, version] : impl_->stale) snapshot.stale.push_back(chunk);
  return snapshot;
}

bool RouteIndex::wait_current(Clock::time_point deadline) const {
  MutexLock lock(impl_->mutex);
  return impl_->wake.wait_until(impl_->mutex, deadline, [this]() RELMAP_REQUIRES(impl_->mutex) {
    return impl_->given_up || !impl_->late_because.empty() ||
           (impl_->shown && impl_->stale.empty() && impl_->shown->outdated() == 0 && !impl_->shown->is_mostly_gone());
  });
}

}  // namespace relmap::route
