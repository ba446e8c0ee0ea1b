#include "server/service/service_manager.h"

#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <utility>

namespace relmap::service {

namespace {

// Asked for again each second, so that a daemon that hangs while it starts or stops is given up after it.
constexpr std::chrono::microseconds kMoreTime = std::chrono::seconds(30);
// A process that hangs uses less in a second, and one that works more.
constexpr std::uint64_t kActive = 20;

std::uint64_t watchdog_pid() {
  const char* const pid = std::getenv("WATCHDOG_PID");
  return pid ? std::strtoull(pid, nullptr, 10) : static_cast<std::uint64_t>(getpid());
}

}  // namespace

std::uint64_t ServiceManager::process_activity() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ms = [](const timeval& time) {
    return static_cast<std::uint64_t>(time.tv_sec) * 1000 + static_cast<std::uint64_t>(time.tv_usec) / 1000;
  };
  std::uint64_t sum = ms(usage.ru_utime) + ms(usage.ru_stime);
  std::ifstream io("/proc/self/io");
  std::string name;
  std::uint64_t bytes = 0;
  while (io >> name >> bytes)
    if (name == "read_bytes:" || name == "write_bytes:") sum += bytes / 65536;
  return sum;
}

ServiceManager::ServiceManager(Activity activity, std::chrono::milliseconds interval) : activity_(std::move(activity)) {
  if (const char* const socket = std::getenv("NOTIFY_SOCKET")) socket_ = socket;
  const char* const watchdog = std::getenv("WATCHDOG_USEC");
  watchdog_ =
      watchdog && std::strtoull(watchdog, nullptr, 10) > 0 && watchdog_pid() == static_cast<std::uint64_t>(getpid());
  // What the daemon starts is not the daemon.
  for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  if (socket_.empty()) return;
  send("STATUS=starting: the map is opened, and the journal applied\n");
  thread_ = std::make_unique<Periodic>(interval, [this] { tell(); });
}

ServiceManager::~ServiceManager() { stops(); }

void ServiceManager::serves(std::function<State()> state) {
  {
    const MutexLock lock(mutex_);
    phase_ = Phase::kServing;
    state_ = std::move(state);
    send("READY=1\n");  // before the thread tells anything of this phase
  }
  if (thread_) thread_->hurry();
}

void ServiceManager::reloads() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  send("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now.tv_sec * 1'000'000 + now.tv_nsec / 1000) + "\n");
}

void ServiceManager::stops() {
  {
    const MutexLock lock(mutex_);
    if (phase_ == Phase::kStopping) return;
    phase_ = Phase::kStopping;
    state_ = {};
    told_.clear();
  }
  send("STOPPING=1\nSTATUS=stopping: what is durable is applied and committed\n");
  if (thread_) thread_->hurry();
}

void ServiceManager::tell() {
  const MutexLock lock(mutex_);
  if (phase_ == Phase::kServing) {
    const State state = state_();
    if (state.live && watchdog_) send("WATCHDOG=1\n");
    if (state.status != told_) send("STATUS=" + state.status + "\n");
    told_ = state.status;
    return;
  }
  const std::uint64_t active = activity_();
  if (active >= active_ + kActive) send("EXTEND_TIMEOUT_USEC=" + std::to_string(kMoreTime.count()) + "\n");
  active_ = active;
}

// Failures are nobody's concern: the manager may be gone, or its queue full.
void ServiceManager::send(const std::string& message) const {
  sockaddr_un address{};
  if (socket_.empty() || socket_.size() >= sizeof address.sun_path) return;
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, socket_.data(), socket_.size());
  if (address.sun_path[0] == '@') address.sun_path[0] = 0;  // an abstract socket
  (void)!::sendto(socket, message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                  reinterpret_cast<const sockaddr*>(&address),
                  static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size()));
  close(socket);
}

}  // namespace relmap::service
