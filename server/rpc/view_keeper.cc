#include "server/rpc/view_keeper.h"

#include <algorithm>
#include <charconv>

namespace relmap {

std::string ViewKeeper::token(const std::shared_ptr<const MapView>& view, std::string_view position) {
  const std::lock_guard lock(mutex_);
  expire_locked();
  keep_locked(view);
  return boot_ + "-" + std::to_string(view->version()) + "-" + std::string(position);
}

Result<Continuation> ViewKeeper::open(const std::string& token, std::shared_ptr<const MapView> newest) {
  if (token.empty()) return Continuation{std::move(newest), ""};
  const Status not_ours(Reason::INVALID_ARGUMENT, "'" + token.substr(0, 64) + "' is no token of this service");
  const std::size_t first = token.find('-');
  const std::size_t second = first == std::string::npos ? first : token.find('-', first + 1);
  if (second == std::string::npos) return not_ours;
  std::uint64_t version = 0;
  const char* const digits_end = token.data() + second;
  const auto [end, error] = std::from_chars(token.data() + first + 1, digits_end, version);
  if (error != std::errc{} || end != digits_end) return not_ours;

  const std::lock_guard lock(mutex_);
  expire_locked();
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.view->version() == version; });
  if (token.compare(0, first, boot_) != 0 || found == kept_.end())
    return {Reason::VIEW_EXPIRED, "map version " + std::to_string(version) + " is no longer held; begin again"};
  auto view = found->view;
  keep_locked(view);
  return Continuation{std::move(view), token.substr(second + 1)};
}

void ViewKeeper::expire() {
  const std::lock_guard lock(mutex_);
  expire_locked();
}

void ViewKeeper::expire_locked() {
  const Clock::time_point oldest = Clock::now() - kMaxAge;
  kept_.remove_if([&](const Kept& k) { return k.used < oldest; });
}

void ViewKeeper::keep_locked(std::shared_ptr<const MapView> view) {
  kept_.remove_if([&](const Kept& k) { return k.view->version() == view->version(); });
  kept_.push_front({std::move(view), Clock::now()});
  if (kept_.size() > kMaxViews) kept_.pop_back();
}

}  // namespace relmap
