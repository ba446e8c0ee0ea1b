// Keeps what page and resume tokens refer to for a while.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <string_view>

#include "proto/base/mutex.h"
#include "proto/base/read_number.h"
#include "proto/base/status.h"
#include "storage/map/map.h"

namespace relmap::rpc {

// What a token refers to. A token is "BOOT-NUMBER-POSITION": the run of the daemon, the number of what is kept, and
// where to continue.
template <typename T>
struct Continuation {
  std::shared_ptr<const T> kept;
  std::string position;  // empty means from the start
};

// Whether the view that it depends on was cut off. There is one function of this name for each type that is kept.
inline bool is_cut_off(const storage::MapView& view) { return view.expired(); }

// Thread-safe.
template <typename T>
class TokenKeeper {
 public:
  static constexpr std::chrono::seconds kMaxAge{120};  // since a token for it was last made or opened
  static constexpr std::chrono::seconds kLinger{3};    // after its end

  // `name` is what is kept, for messages. At most `max_kept` are kept.
  TokenKeeper(std::string_view boot_id, std::string name, std::size_t max_kept, std::chrono::seconds linger = kLinger)
      : boot_(boot_id.substr(0, 8)), name_(std::move(name)), max_kept_(max_kept), linger_(linger) {}

  // Keeps an object under this number and returns a token for `position` in it.
  std::string token(std::uint64_t number, std::shared_ptr<const T> kept, std::string_view position) {
    const MutexLock lock(mutex_);
    expire_locked();
    keep_locked(number, std::move(kept));
    return boot_ + "-" + std::to_string(number) + "-" + std::string(position);
  }

  // Returns what a token refers to. INVALID_ARGUMENT if it is not a token of this service; VIEW_EXPIRED if it is of
  // another run of the daemon or too old.
  Result<Continuation<T>> open(const std::string& token) {
    const Status not_ours(Reason::INVALID_ARGUMENT, "'" + token.substr(0, 64) + "' is not a token of this service");
    const std::size_t first = token.find('-');
    const std::size_t second = first == std::string::npos ? first : token.find('-', first + 1);
    if (second == std::string::npos) return not_ours;
    std::uint64_t number = 0;
    if (!read_number(std::string_view(token).substr(first + 1, second - first - 1), number)) return not_ours;

    const MutexLock lock(mutex_);
    expire_locked();
    const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.number == number; });
    if (token.compare(0, first, boot_) != 0 || found == kept_.end())
      return {Reason::VIEW_EXPIRED, name_ + " " + std::to_string(number) + " is no longer held; begin again"};
    auto kept = found->kept;
    keep_locked(number, kept);
    return Continuation<T>{std::move(kept), token.substr(second + 1)};
  }

  // Tells that all of an object was sent. It is kept a little longer, since what was sent last may not have arrived.
  void end(std::uint64_t number) {
    const MutexLock lock(mutex_);
    for (Kept& kept : kept_)
      if (kept.number == number) kept.used = Clock::now() - kMaxAge + linger_;
  }
  // Drops the least recently used object. False if nothing is kept.
  bool drop_oldest() {
    const MutexLock lock(mutex_);
    if (kept_.empty()) return false;
    kept_.pop_back();
    return true;
  }
  // Drops what is too old, and what depends on a view that was cut off, so that its memory is freed. Must be called now
  // and then.
  void expire() {
    const MutexLock lock(mutex_);
    expire_locked();
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct Kept {
    std::uint64_t number;
    std::shared_ptr<const T> kept;
    Clock::time_point used;
  };
  void expire_locked() RELMAP_REQUIRES(mutex_) {
    const Clock::time_point oldest = Clock::now() - kMaxAge;
    kept_.remove_if([&](const Kept& k) { return k.used <= oldest || is_cut_off(*k.kept); });
  }
  void keep_locked(std::uint64_t number, std::shared_ptr<const T> kept) RELMAP_REQUIRES(mutex_) {
    kept_.remove_if([&](const Kept& k) { return k.number == number; });
    kept_.push_front({number, std::move(kept), Clock::now()});
    if (kept_.size() > max_kept_) kept_.pop_back();
  }

  const std::string boot_, name_;
  const std::size_t max_kept_;
  const std::chrono::seconds linger_;
  Mutex mutex_;
  std::list<Kept> kept_ RELMAP_GUARDED_BY(mutex_);  // most recently used first
};

// Keeps map versions by their numbers.
class ViewKeeper : public TokenKeeper<storage::MapView> {
 public:
  explicit ViewKeeper(std::string_view boot_id) : TokenKeeper(boot_id, "map version", 8) {}
  std::string token(const std::shared_ptr<const storage::MapView>& view, std::string_view position) {
    return TokenKeeper::token(view->version(), view, position);
  }
  // With an empty token, returns `newest` from the start.
  Result<Continuation<storage::MapView>> open(const std::string& token,
                                              std::shared_ptr<const storage::MapView> newest) {
    if (token.empty()) return Continuation<storage::MapView>{std::move(newest), ""};
    return TokenKeeper::open(token);
  }
};

}  // namespace relmap::rpc
