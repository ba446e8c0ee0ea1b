// Keeps a layout of the map up with the map, and serves what the page asks of it.
//
// A thread asks the daemon for its version of the map, and makes a new layout when that has changed: at most as often
// as it costs. The layout that is there stays served meanwhile, and when the daemon does not answer. Of a large map of
// which none is kept on disk, a coarse one is made first.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "client/relmap_client.h"
#include "proto/base/mutex.h"
#include "tools/console/layout/kept_client.h"
#include "tools/console/layout/tile_index.h"
#include "tools/console/layout/tile_source.h"

namespace relmap::console {

struct KeeperOptions {
  KeptClient::Connect connect;  // with credentials that may read the map; called again after anything failed
  KeptClient::Credentials credentials = {};               // that connect() shows
  std::string cache_folder = {};                          // of layouts on disk; empty: none are kept there
  std::function<void(const std::string& line)> log = {};  // of what goes wrong; empty: nobody is told
  std::chrono::milliseconds poll{500};                    // between questions to the daemon
  std::uint64_t coarse_above = 50'000;                    // keyframes
  TileSource::Limits limits = {};
};

// What is served, and how it stands to the map.
struct KeeperState {
  std::shared_ptr<const MapLayout> layout;  // null: there is none yet
  // The versions of the map that the daemon has made since.
  std::uint64_t behind = 0;
  struct Progress {
    std::string step;  // "reading", "relaxing" or "drawing"
    std::uint64_t done = 0, total = 0;
  };
  std::optional<Progress> progress;  // of the next layout
  Status error;                      // not ok: why the layout is not kept up
  Status empty;                      // not ok: why there is nothing to draw
};

// Thread-safe.
class LayoutKeeper {
 public:
  explicit LayoutKeeper(KeeperOptions options);
  ~LayoutKeeper();
  LayoutKeeper(const LayoutKeeper&) = delete;
  LayoutKeeper& operator=(const LayoutKeeper&) = delete;

  // Ends the thread, and all who wait. What is served stays served.
  void stop();

  KeeperState state() const;
  // Grows whenever the layout, its progress, an error or what `empty` says has changed.
  std::uint64_t changes() const;
  // The answer to /map/layout.
  std::string state_json() const;
  // The answer to /map/tiles; null: nothing is there. VIEW_EXPIRED: the layout of this version, or of `from`, is gone.
  // The reasons of TileSource::tile().
  Result<TileSource::TileBytes> tile(const TileRequest& request);
  // The same, but nullopt where the daemon would be asked for something, which tile() waits for.
  Result<std::optional<TileSource::TileBytes>> tile_at_once(const TileRequest& request);
  // The answer to /map/places, given what was sent: JSON with `frames`, at most kMaxPlaces. INVALID_ARGUMENT: it is
  // not. VIEW_EXPIRED: there is no layout yet.
  static constexpr std::size_t kMaxPlaces = 10'000;
  Result<std::string> places_json(std::string_view request) const;

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kVersionsKept = 3;

  struct Versions {
    std::shared_ptr<const TileIndex> wanted, old;  // null: without positions in an older layout
  };
  Result<Versions> versions_of(const TileRequest& request) const;

  void run();
  Status round();
  void take_up(const MapIdentity& map);  // starts with what is on disk of it
  Status find_behind(client::Client& client, const client::DaemonStatus& status);
  Status make(client::Client& client, const client::DaemonStatus& status);
  Status make_at(std::uint32_t level, bool coarse, client::Client& client, const client::DaemonStatus& status);
  // WRONG_MAP: another daemon has answered than the one of `status`.
  Result<client::Skeleton> read(std::uint32_t level, client::Client& client, const client::DaemonStatus& status);
  // EMPTY_MAP: nothing of the map is in metres.
  Result<MapLayout> lay_out(const client::Skeleton& skeleton, bool coarse, const MapLayout* before);
  void publish(MapLayout layout);
  void show_nothing(const std::string& why);
  void save();
  void tell(const std::string& line) const;
  void show(KeeperState::Progress progress);
  void clear_progress();
  Status going() const;  // SHUTTING_DOWN once it is to stop
  void changed() RELMAP_REQUIRES(mutex_);

  const KeeperOptions options_;
  KeptClient client_;
  TileSource source_;

  mutable Mutex mutex_;
  mutable ConditionVariable changed_;
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::uint64_t changes_ RELMAP_GUARDED_BY(mutex_) = 0;
  KeeperState state_ RELMAP_GUARDED_BY(mutex_);
  std::vector<std::shared_ptr<const TileIndex>> kept_ RELMAP_GUARDED_BY(mutex_);  // the newest first

  // Of the thread.
  MapIdentity map_;
  std::string boot_id_;  // of the daemon that has the version below
  // Which the layout shows, or in which there was nothing to draw, or that came after those in `behind_before_`.
  std::uint64_t map_version_ = 0;
  std::uint64_t behind_before_ = 0;  // versions that the layout was behind already when this daemon was met
  bool behind_known_ = false;        // these three are set
  Clock::time_point next_{};         // no layout is made before
  bool unsaved_ = false;
  Clock::time_point saved_{};
  Clock::time_point shown_{};  // progress, last

  std::thread thread_;
};

}  // namespace relmap::console
