#include "tools/console/layout/layout_keeper.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/skeleton_relaxation.h"
#include "tools/console/layout/layout_file.h"
#include "tools/console/layout/layout_json.h"
#include "tools/console/layout/make_layout.h"

namespace relmap::console {
namespace {

constexpr std::chrono::milliseconds kRetry{1000}, kLeastPause{300}, kShowEvery{250};
constexpr std::chrono::seconds kSaveEvery{30};
constexpr int kCoarseIterations = 1;

std::uint64_t now_ms() {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count());
}

}  // namespace

LayoutKeeper::LayoutKeeper(KeeperOptions options)
    : options_(std::move(options)),
      client_(options_.connect, options_.credentials),
      source_(options_.limits),
      thread_([this] { run(); }) {}

LayoutKeeper::~LayoutKeeper() { stop(); }

void LayoutKeeper::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

KeeperState LayoutKeeper::state() const {
  const MutexLock lock(mutex_);
  return state_;
}

std::uint64_t LayoutKeeper::changes() const {
  const MutexLock lock(mutex_);
  return changes_;
}

std::string LayoutKeeper::state_json() const { return json_of(state()); }

Result<LayoutKeeper::Versions> LayoutKeeper::versions_of(const TileRequest& request) const {
  Versions versions;
  {
    const MutexLock lock(mutex_);
    for (const auto& kept : kept_) {
      if (kept->layout().version == request.version) versions.wanted = kept;
      if (kept->layout().version == request.from) versions.old = kept;
    }
  }
  if (!versions.wanted || (request.from != 0 && !versions.old))
    return {Reason::VIEW_EXPIRED, "the layout of version " +
                                      std::to_string(versions.wanted ? request.from : request.version) +
                                      " is gone; ask for the newest one"};
  return versions;
}

Result<TileSource::TileBytes> LayoutKeeper::tile(const TileRequest& request) {
  const auto versions = versions_of(request);
  if (!versions.ok()) return versions.status();
  return source_.tile(*versions->wanted, versions->old ? &versions->old->layout() : nullptr, request,
                      [this] { return client_.get(); });
}

Result<std::optional<TileSource::TileBytes>> LayoutKeeper::tile_at_once(const TileRequest& request) {
  const auto versions = versions_of(request);
  if (!versions.ok()) return versions.status();
  return source_.tile_at_once(*versions->wanted, versions->old ? &versions->old->layout() : nullptr, request);
}

Result<std::string> LayoutKeeper::places_json(std::string_view request) const {
  const auto frames = frames_of_request(request, kMaxPlaces);
  if (!frames.ok()) return frames.status();
  const std::shared_ptr<const MapLayout> layout = state().layout;
  if (!layout) return {Reason::VIEW_EXPIRED, "there is no layout yet"};
  return json_of_places(*layout, *frames);
}

void LayoutKeeper::run() {
  for (;;) {
    Status status;
    try {
      status = round();
    } catch (...) {
      status = caught_status();
    }
    const bool failed = !status.ok(), ending = !going().ok();
    if (failed && !ending) {
      client_.drop();  // it may have broken, or its token have been revoked
      if (const Status before = state().error; before.to_string() != status.to_string())
        tell("the layout is not kept up: " + status.to_string());
    }
    clear_progress();
    const MutexLock lock(mutex_);
    if (!ending && state_.error.to_string() != status.to_string()) {
      state_.error = status;
      changed();
    }
    if (changed_.wait_for(mutex_, failed ? std::max(kRetry, options_.poll) : options_.poll,
                          [this]() RELMAP_REQUIRES(mutex_) { return stopping_; }))
      break;
  }
  save();
}

Status LayoutKeeper::round() {
  const auto client = client_.get();
  if (!client.ok()) return client.status();
  const auto status = (*client)->status();
  if (!status.ok()) return status.status();
  if (!(status->map == map_)) take_up(status->map);
  if (status->frames == 0) {
    behind_known_ = false;
    show_nothing("the map has no keyframes yet");
    return {};
  }
  if (Status found = find_behind(**client, *status); !found.ok()) return found;
  const KeeperState now = state();
  if (now.layout && now.behind == 0 && !now.layout->coarse) return {};
  const bool read = behind_known_ && boot_id_ == status->boot_id && status->map_version <= map_version_;
  if (!now.layout && read) return {};  // there was nothing to draw, and nothing has changed
  if (Clock::now() < next_) return {};
  return make(**client, *status);
}

void LayoutKeeper::take_up(const MapIdentity& map) {
  save();
  map_ = map;
  behind_known_ = false;
  next_ = {};
  {
    const MutexLock lock(mutex_);
    if (state_.layout || !state_.empty.ok()) {
      state_ = {};
      kept_.clear();
      changed();
    }
  }
  if (options_.cache_folder.empty() || !map.known()) return;
  auto loaded = load_layout(options_.cache_folder, map);
  if (loaded.ok()) {
    publish(*std::move(loaded));
    unsaved_ = false;
  } else if (loaded.reason() != Reason::NO_SUCH_FILE) {
    tell("a layout on disk is not used, and will be made anew: " + loaded.status().to_string());
  }
}

// A layout from disk is of another start of the daemon, whose versions mean nothing now; the commits of the stored map
// outlast starts.
Status LayoutKeeper::find_behind(client::Client& client, const client::DaemonStatus& status) {
  const std::shared_ptr<const MapLayout> layout = state().layout;
  if (!layout) return {};
  if (!behind_known_ || boot_id_ != status.boot_id) {
    bool told = false;
    std::uint64_t commit = 0, frames = 0;
    const auto first = client.skeleton({.level = 0, .candidates = true}, [&](const client::Skeleton& so_far) -> Status {
      told = true;
      commit = so_far.commit_number;
      frames = so_far.frames;
      map_version_ = so_far.map_version;
      return {Reason::VIEW_EXPIRED, "enough is known"};
    });
    if (!told) return first.status();
    boot_id_ = status.boot_id;
    behind_known_ = true;
    const bool same = commit == layout->commit_number && frames == layout->frames;
    const std::uint64_t commits = commit > layout->commit_number ? commit - layout->commit_number : 1;
    behind_before_ = same ? 0 : commits;
  }
  const MutexLock lock(mutex_);
  state_.behind = behind_before_ + status.map_version - std::min(status.map_version, map_version_);
  return {};
}

Status LayoutKeeper::make(client::Client& client, const client::DaemonStatus& status) {
  const bool none = !state().layout;
  if (none && status.frames > options_.coarse_above) {
    if (Status made = make_at(0, true, client, status); !made.ok()) return made;
    if (!state().layout) return {};
  }
  return make_at(client::level_for(status.frames), false, client, status);
}

Status LayoutKeeper::make_at(std::uint32_t level, bool coarse, client::Client& client,
                             const client::DaemonStatus& status) {
  const Clock::time_point begun = Clock::now();
  auto skeleton = read(level, client, status);
  if (skeleton.reason() == Reason::WRONG_MAP) return {};  // the next round begins anew, with what answers now
  if (!skeleton.ok()) return skeleton.status();
  const std::shared_ptr<const MapLayout> before = state().layout;
  auto layout = lay_out(*skeleton, coarse, before.get());
  const bool empty = layout.reason() == Reason::EMPTY_MAP;
  if (!layout.ok() && !empty) return layout.status();
  const Clock::duration took = Clock::now() - begun;
  next_ = Clock::now() + std::max<Clock::duration>(kLeastPause, 3 * took);
  boot_id_ = status.boot_id;
  map_version_ = skeleton->map_version;
  behind_before_ = 0;
  behind_known_ = true;
  if (empty) {
    show_nothing("the map has no keyframes in metres yet: sessions of one camera have no scale, and are not drawn");
    return {};
  }
  skeleton = client::Skeleton();  // the layout has what is needed of it
  layout->map = status.map;
  layout->boot_id = status.boot_id;
  layout->level = level;
  layout->coarse = coarse;
  layout->version = std::max(now_ms(), before ? before->version + 1 : 0);
  layout->seconds = std::chrono::duration<double>(took).count();
  publish(*std::move(layout));
  unsaved_ = !coarse;
  if (Clock::now() - saved_ > kSaveEvery) save();
  return {};
}

Result<client::Skeleton> LayoutKeeper::read(std::uint32_t level, client::Client& client,
                                            const client::DaemonStatus& status) {
  show({"reading", 0, status.frames});
  auto skeleton = client.skeleton({.level = level, .candidates = true}, [&](const client::Skeleton& so_far) -> Status {
    show({"reading", so_far.frames_done, so_far.frames});
    return going();
  });
  if (!skeleton.ok()) return skeleton;
  const auto now = client.status();
  if (!now.ok()) return now.status();
  if (now->boot_id != status.boot_id || !(now->map == status.map))
    return Status(Reason::WRONG_MAP, "another daemon has come to the same address");
  return skeleton;
}

Result<MapLayout> LayoutKeeper::lay_out(const client::Skeleton& skeleton, bool coarse, const MapLayout* before) {
  client::SkeletonLayout how;
  if (skeleton.points() == skeleton.frames) how.relaxation = {};  // a small map is worth the time
  if (coarse) how.relaxation.max_iterations = kCoarseIterations;
  const auto total = static_cast<std::uint64_t>(how.relaxation.max_iterations);
  std::uint64_t most = 0;  // of the part that needs most
  how.relaxation.proceed = [&](int iterations) {
    most = std::max(most, static_cast<std::uint64_t>(iterations));
    show({"relaxing", most, total});
    return going();
  };
  const auto relaxed = client::relax_skeleton(skeleton, how);
  if (!relaxed.ok()) return relaxed.status();
  show({"drawing", 0, 0});
  return make_layout(skeleton, *relaxed, before);
}

void LayoutKeeper::publish(MapLayout layout) {
  auto index = std::make_shared<const TileIndex>(std::make_shared<const MapLayout>(std::move(layout)));
  const MutexLock lock(mutex_);
  kept_.insert(kept_.begin(), index);
  if (kept_.size() > kVersionsKept) kept_.pop_back();
  state_.layout = index->shared_layout();
  state_.behind = 0;
  state_.progress.reset();
  state_.empty = {};
  changed();
}

void LayoutKeeper::show_nothing(const std::string& why) {
  const MutexLock lock(mutex_);
  if (!state_.layout && state_.empty.message() == why) return;
  state_ = {};
  state_.empty = {Reason::EMPTY_MAP, why};
  kept_.clear();
  changed();
}

void LayoutKeeper::save() {
  if (!unsaved_ || options_.cache_folder.empty()) return;
  const std::shared_ptr<const MapLayout> layout = state().layout;
  if (!layout || !layout->map.known()) return;
  if (const Status saved = save_layout(options_.cache_folder, *layout); !saved.ok())
    tell("the layout is not kept on disk: " + saved.to_string());
  unsaved_ = false;
  saved_ = Clock::now();
}

void LayoutKeeper::tell(const std::string& line) const {
  if (options_.log) options_.log(line);
}

void LayoutKeeper::show(KeeperState::Progress progress) {
  const Clock::time_point now = Clock::now();
  const MutexLock lock(mutex_);
  const bool other = !state_.progress || state_.progress->step != progress.step;
  if (!other && now - shown_ < kShowEvery) return;
  shown_ = now;
  state_.progress = std::move(progress);
  changed();
}

void LayoutKeeper::clear_progress() {
  const MutexLock lock(mutex_);
  if (!state_.progress) return;
  state_.progress.reset();
  changed();
}

Status LayoutKeeper::going() const {
  const MutexLock lock(mutex_);
  if (stopping_) return {Reason::SHUTTING_DOWN, "the console stops"};
  return {};
}

void LayoutKeeper::changed() {
  ++changes_;
  changed_.notify_all();
}

}  // namespace relmap::console
