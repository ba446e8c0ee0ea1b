// Map versions that page and resume tokens refer to, kept for a while.
#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "storage/map.h"

namespace relmap {

// "BOOT-VERSION-POSITION": which daemon, which version of the map, where to go on.
struct Continuation {
  std::shared_ptr<const MapView> view;
  std::string position;  // empty: from the start
};

// Thread-safe.
class ViewKeeper {
 public:
  static constexpr std::size_t kMaxViews = 8;
  static constexpr std::chrono::seconds kMaxAge{120};  // since a token last gave or took it

  explicit ViewKeeper(std::string boot_id) : boot_(boot_id.substr(0, 8)) {}

  // A token for `position` in `view`, which is kept from now on.
  std::string token(const std::shared_ptr<const MapView>& view, std::string_view position);

  // Without a token: `newest`, from the start. INVALID_ARGUMENT: no token of ours; VIEW_EXPIRED: of another run of the
  // daemon, or too old.
  Result<Continuation> open(const std::string& token, std::shared_ptr<const MapView> newest);

  // Lets go of what is too old; called now and then.
  void expire();

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    std::shared_ptr<const MapView> view;
    Clock::time_point used;
  };
  void expire_locked();
  void keep_locked(std::shared_ptr<const MapView> view);

  const std::string boot_;
  std::mutex mutex_;
  std::list<Kept> kept_;  // most recently used first
};

}  // namespace relmap
