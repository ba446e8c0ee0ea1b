#include "server/route/overlay/route_index.h"

#include <sys/resource.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <unordered_map>

namespace relmap {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kChunksAtOnce = 256;       // read and made before others are looked at
constexpr std::chrono::milliseconds kSlice{50};  // of making cells before what is made is shown
constexpr std::chrono::milliseconds kMostRest{1000};
// After a map that could not be read, at least and at most.
constexpr std::chrono::milliseconds kRetry{500}, kLateRetry{60'000};
// After cells that found no room, and then twice as long each time.
constexpr std::chrono::minutes kMakeRoom{1}, kMostMakeRoom{60};

}  // namespace

struct RouteIndex::Impl {
  Impl(RouteIndexOptions o, CurrentView v, std::shared_ptr<Budget> b)
      : options(std::move(o)), current_view(std::move(v)), budget(std::move(b)), working(options.metrics) {}

  void run();
  bool work();
  bool is_mostly_new(const std::vector<ChunkId>& chunks) const;
  void show(std::uint64_t version, const std::vector<ChunkId>& known);
  void give_up(const std::string& why);
  Status proceed(std::size_t bytes) const;

  const RouteIndexOptions options;
  const CurrentView current_view;
  const std::shared_ptr<Budget> budget;
  Overlay working;  // the thread's own

  mutable std::mutex mutex;
  mutable std::condition_variable wake;
  std::unordered_map<ChunkId, std::uint64_t> stale;  // since which version of the map
  std::shared_ptr<const Overlay> shown;              // null: none, or not yet
  std::string missing_because = "the cells of this map are still being made";
  bool given_up = false;  // for a while
  bool stopping = false;
  std::thread thread;
};

void RouteIndex::Impl::run() {
  ::setpriority(PRIO_PROCESS, 0, 10);  // of this thread: robots and callers go first
  std::unique_lock lock(mutex);
  Clock::duration make_room = kMakeRoom;
  while (!stopping) {
    lock.unlock();
    const auto start = Clock::now();
    const auto rest = [&](Clock::duration least, Clock::duration most) {
      const auto share =
          std::chrono::duration_cast<Clock::duration>((Clock::now() - start) * (1 / options.work_share - 1));
      return std::clamp(share, least, most);
    };
    bool more = true;
    Clock::duration pause{};
    Status trouble;
    try {
      more = work();
      pause = rest({}, kMostRest);
    } catch (const StatusError& error) {
      // A view that was cut off, a part that cannot be read: until it can, what changed stays stale.
      trouble = error.status();
      pause = rest(kRetry, kLateRetry);
    }
    if (trouble.reason() == Reason::BUDGET_EXCEEDED) {
      give_up(trouble.message());
      pause = make_room;
      make_room = std::min<Clock::duration>(2 * make_room, kMostMakeRoom);
    } else if (trouble.ok()) {
      make_room = kMakeRoom;
    }
    lock.lock();
    if (!trouble.ok() && !shown) missing_because = trouble.message();
    wake.notify_all();
    wake.wait_for(lock, pause, [this] { return stopping; });
    if (!more) wake.wait(lock, [this] { return stopping || !stale.empty(); });
  }
}

// Some of what is to be done; whether there is more.
bool RouteIndex::Impl::work() {
  std::vector<ChunkId> chunks;
  std::shared_ptr<const MapView> view;
  {
    const std::lock_guard lock(mutex);
    given_up = false;
    view = current_view();
    for (const auto& [chunk, version] : stale) chunks.push_back(chunk);
  }
  if (!shown || is_mostly_new(chunks)) {
    working.build(*view, [this](std::size_t bytes) { return proceed(bytes); });
  } else {
    if (chunks.size() > kChunksAtOnce) chunks.resize(kChunksAtOnce);
    working.refresh(*view, chunks);
  }
  show(view->version(), chunks);
  view.reset();
  if (working.outdated() > 0) {
    for (const auto start = Clock::now(); Clock::now() - start < kSlice && working.make_next();) {
    }
    show(0, {});
  }
  const std::lock_guard lock(mutex);
  return working.outdated() > 0 || !stale.empty();
}

// Cells grown one by one lie as well as those made together only while they are the lesser part.
bool RouteIndex::Impl::is_mostly_new(const std::vector<ChunkId>& chunks) const {
  const auto fresh = std::count_if(chunks.begin(), chunks.end(),
                                   [this](ChunkId chunk) { return working.tree().find(chunk) == CellTree::kNone; });
  return fresh > 64 && static_cast<std::uint32_t>(fresh) > working.tree().chunks() / 4;
}

// What was made of the map of this version, which these chunks are known of.
void RouteIndex::Impl::show(std::uint64_t version, const std::vector<ChunkId>& known) {
  const std::size_t bytes = working.memory_bytes();
  budget->set(Share::kRoutes, bytes);
  if (Status status = proceed(bytes); !status.ok()) throw StatusError(status);
  auto copy = std::make_shared<const Overlay>(working);
  const std::lock_guard lock(mutex);
  std::swap(shown, copy);
  missing_because.clear();
  for (const ChunkId chunk : known)
    if (const auto at = stale.find(chunk); at != stale.end() && at->second <= version) stale.erase(at);
}

void RouteIndex::Impl::give_up(const std::string& why) {
  working = Overlay(options.metrics);
  budget->set(Share::kRoutes, 0);
  const std::lock_guard lock(mutex);
  shown.reset();
  missing_because = why;
  given_up = true;
}

Status RouteIndex::Impl::proceed(std::size_t bytes) const {
  const std::size_t most = budget->allowance(Share::kRoutes);
  const std::size_t others = budget->used() - budget->used(Share::kCache) - budget->used(Share::kRoutes);
  if (bytes > most || others + bytes > budget->limit())
    return {Reason::BUDGET_EXCEEDED, "the cells of this map take more than the " + std::to_string(most >> 20) +
                                         " MB, or less, that memory_budget_mb leaves for them"};
  const std::lock_guard lock(mutex);
  return stopping ? Status(Reason::SHUTTING_DOWN, "the daemon stops") : Status();
}

RouteIndex::RouteIndex(RouteIndexOptions options, CurrentView view, std::shared_ptr<Budget> budget)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(view), std::move(budget))) {}

void RouteIndex::start() {
  impl_->thread = std::thread([this] { impl_->run(); });
}

RouteIndex::~RouteIndex() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopping = true;
    impl_->wake.notify_all();
  }
  if (impl_->thread.joinable()) impl_->thread.join();
  impl_->budget->set(Share::kRoutes, 0);
}

void RouteIndex::changed(std::uint64_t version, std::span<const ChunkId> chunks) {
  const std::lock_guard lock(impl_->mutex);
  const bool idle = impl_->stale.empty();
  for (const ChunkId chunk : chunks) impl_->stale[chunk] = version;
  if (idle) impl_->wake.notify_all();
}

RouteIndex::Snapshot RouteIndex::snapshot() const {
  const std::lock_guard lock(impl_->mutex);
  // What a view shows is told before it is there: whatever this one has more than the cells know is stale.
  Snapshot snapshot{impl_->current_view(), impl_->shown, impl_->missing_because, {}};
  if (!snapshot.overlay) return snapshot;
  snapshot.stale.reserve(impl_->stale.size());
  for (const auto& [chunk, version] : impl_->stale) snapshot.stale.push_back(chunk);
  return snapshot;
}

bool RouteIndex::wait_settled(Clock::time_point deadline) const {
  std::unique_lock lock(impl_->mutex);
  return impl_->wake.wait_until(lock, deadline, [this] {
    return impl_->given_up || (impl_->shown && impl_->stale.empty() && impl_->shown->outdated() == 0);
  });
}

}  // namespace relmap
