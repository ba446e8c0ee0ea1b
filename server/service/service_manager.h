// Tells the service manager, systemd, how the daemon is (sd_notify(3), systemd.service(5)).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "proto/base/mutex.h"
#include "server/service/periodic.h"

namespace relmap::service {

class ServiceManager {
 public:
  // What is told while the daemon serves.
  struct State {
    bool live = true;    // false: the watchdog is not fed, and ends the daemon in the end
    std::string status;  // one line for people
  };
  // Time that the process has used of a processor and that it has read and written, as a sum that grows while it works.
  using Activity = std::function<std::uint64_t()>;

  // Finds the manager's socket, and whether it has a watchdog, in the environment. Without one nothing is told. While
  // the daemon starts or stops, the manager is asked for more time as long as `activity` grows.
  explicit ServiceManager(Activity activity = process_activity, std::chrono::milliseconds interval = kInterval);
  // Tells that the daemon stops, if stops() has not.
  ~ServiceManager();

  // The daemon serves from now on. `state` is called once a second from another thread, until stops() returns.
  void serves(std::function<State()> state);
  // Settings are being read again, until the next serves().
  void reloads();
  // The daemon is stopping from now on.
  void stops();

  static constexpr std::chrono::milliseconds kInterval{1000};
  // Milliseconds of processor time, and 64 KiB blocks read and written.
  static std::uint64_t process_activity();

 private:
  enum class Phase { kStarting, kServing, kStopping };
  void tell();
  void send(const std::string& message) const;

  const Activity activity_;
  std::string socket_;  // empty: there is no manager
  bool watchdog_ = false;
  mutable Mutex mutex_;
  Phase phase_ RELMAP_GUARDED_BY(mutex_) = Phase::kStarting;
  std::function<State()> state_ RELMAP_GUARDED_BY(mutex_);
  std::string told_ RELMAP_GUARDED_BY(mutex_);          // the last status
  std::uint64_t active_ RELMAP_GUARDED_BY(mutex_) = 0;  // at the last look
  std::unique_ptr<Periodic> thread_;                    // declared last: it uses all others
};

}  // namespace relmap::service
