#include "server/rpc/listener.h"

#include <fcntl.h>
#include <grp.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <utility>

namespace relmap::rpc {

namespace {

constexpr int kBacklog = 512;
constexpr std::chrono::milliseconds kPause{100};  // when nothing can be accepted, as without a free descriptor
constexpr std::chrono::seconds kToldAgain{1};     // between messages of what is refused
constexpr std::chrono::milliseconds kQuietLook{
    5000};  // between looks for connections that have been quiet for too long

int open_spare() { return open("/dev/null", O_RDONLY | O_CLOEXEC); }

std::string error_text() { return std::strerror(errno); }

}  // namespace

Result<gid_t> group_of(const std::string& name) {
  std::array<char, 4096> buffer{};
  group entry{};
  group* found = nullptr;
  if (getgrnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || !found)
    return Status(Reason::BAD_CONFIG, "there is no group " + name);
  return found->gr_gid;
}

ListeningSocket::~ListeningSocket() {
  if (fd_ < 0) return;
  close(fd_);
  if (!path_.empty()) unlink(path_.c_str());
}

Result<ListeningSocket> ListeningSocket::at_path(const std::string& path, const std::string& group) {
  const std::string temporary = path + ".new";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (temporary.size() >= sizeof address.sun_path)
    return Status(Reason::BAD_CONFIG, "the path of the socket is too long: " + path);
  std::memcpy(address.sun_path, temporary.data(), temporary.size());
  const auto failed = [&] { return Status(Reason::IO_ERROR, "cannot listen at " + path + ": " + error_text()); };
  ListeningSocket socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket.fd_ < 0) return failed();
  unlink(temporary.c_str());
  socket.path_ = temporary;
  // bind() gives the file the mode of the socket, so that at no time anyone else can open it.
  if (fchmod(socket.fd_, S_IRUSR | S_IWUSR) != 0 ||
      bind(socket.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return failed();
  if (!group.empty()) {
    const auto id = group_of(group);
    if (!id.ok()) return id.status();
    if (chown(temporary.c_str(), static_cast<uid_t>(-1), *id) != 0 ||
        chmod(temporary.c_str(), S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP) != 0)
      return failed();
  }
  if (listen(socket.fd_, kBacklog) != 0 || std::rename(temporary.c_str(), path.c_str()) != 0) return failed();
  socket.path_ = path;
  return socket;
}

Result<std::vector<ListeningSocket>> ListeningSocket::at_host(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* list = nullptr;
  if (const int error = getaddrinfo(host.c_str(), "0", &hints, &list); error != 0)
    return Status(Reason::PORT_IN_USE, "cannot listen on " + host + ": " + gai_strerror(error));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owned(list, freeaddrinfo);
  std::vector<ListeningSocket> sockets;
  for (addrinfo* one = list; one; one = one->ai_next) {
    ListeningSocket socket(::socket(one->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (socket.fd_ < 0) continue;  // no IPv6 on this machine, for example
    const int on = 1, off = 0;
    setsockopt(socket.fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (one->ai_family == AF_INET6) {
      setsockopt(socket.fd_, IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
      reinterpret_cast<sockaddr_in6*>(one->ai_addr)->sin6_port = htons(port);
    } else {
      reinterpret_cast<sockaddr_in*>(one->ai_addr)->sin_port = htons(port);
    }
    if (bind(socket.fd_, one->ai_addr, one->ai_addrlen) != 0 || listen(socket.fd_, kBacklog) != 0) {
      if (errno == EADDRNOTAVAIL) continue;  // IPv6 is switched off, for example
      return Status(Reason::PORT_IN_USE, "cannot listen on " + host + ":" + std::to_string(port) + ": " + error_text());
    }
    port = socket.port();
    sockets.push_back(std::move(socket));
  }
  if (sockets.empty()) return Status(Reason::PORT_IN_USE, "cannot listen on " + host + ": it has no address here");
  return sockets;
}

namespace {

sockaddr_storage address_of(int socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  (void)getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  return address;
}

bool is_loopback(const sockaddr_storage& address) {
  constexpr std::uint8_t kLoopbackNet = 127;
  if (address.ss_family == AF_INET6) {
    const in6_addr& six = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
    return IN6_IS_ADDR_LOOPBACK(&six) || (IN6_IS_ADDR_V4MAPPED(&six) && six.s6_addr[12] == kLoopbackNet);
  }
  return address.ss_family == AF_INET &&
         ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) >> 24 == kLoopbackNet;
}

}  // namespace

bool ListeningSocket::is_v6() const { return address_of(fd_).ss_family == AF_INET6; }

bool ListeningSocket::is_local() const { return is_loopback(address_of(fd_)); }

bool is_of_this_machine(int connection) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  return getpeername(connection, reinterpret_cast<sockaddr*>(&address), &size) == 0 && is_loopback(address);
}

std::uint16_t ListeningSocket::port() const {
  const sockaddr_storage address = address_of(fd_);
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

Listener::Listener(std::vector<Source> sources, Connections& connections)
    : sources_(std::move(sources)), connections_(connections), wake_(eventfd(0, EFD_CLOEXEC)), spare_(open_spare()) {
  if (wake_ < 0) throw StatusError(Status(Reason::IO_ERROR, "no eventfd: " + error_text()));
  thread_ = std::thread([this] { run(); });
}

Listener::~Listener() { stop(); }

void Listener::stop() {
  if (!thread_.joinable()) return;
  eventfd_write(wake_, 1);
  thread_.join();
  close(wake_);
  if (spare_ >= 0) close(spare_);
  sources_.clear();  // who connects from now on is refused, and need not wait
}

void Listener::run() {
  std::vector<pollfd> waiting;
  for (const Source& source : sources_) waiting.push_back({source.socket.fd(), POLLIN, 0});
  waiting.push_back({wake_, POLLIN, 0});
  const std::chrono::milliseconds half(static_cast<std::int64_t>(500 * connections_.limits().quiet_s));
  const auto look = std::min(kQuietLook, half);
  auto looked = Connections::Clock::now();
  for (;;) {
    const int ready = poll(waiting.data(), waiting.size(), static_cast<int>(look.count()));
    if (const auto now = Connections::Clock::now(); now - looked >= look) {
      connections_.close_quiet(now);
      looked = now;
    }
    if (ready < 0 && errno != EINTR) std::this_thread::sleep_for(kPause);  // too little memory, or too few files
    if (ready <= 0) continue;
    if (waiting.back().revents != 0) return;
    for (std::size_t i = 0; i < sources_.size(); ++i)
      if (waiting[i].revents != 0) accept_from(sources_[i]);
  }
}

void Listener::accept_from(const Source& source) {
  const int connection = accept4(source.socket.fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection < 0) {
    if (errno == EAGAIN || errno == EINTR || errno == ECONNABORTED) return;  // it has gone already
    const bool no_file = errno == EMFILE || errno == ENFILE;
    const Status why(no_file ? Reason::TOO_MANY_FILES : Reason::IO_ERROR,
                     "no connection can be accepted: " + error_text());
    connections_.not_accepted(why, Connections::Clock::now());
    if (tells()) spdlog::error("{}", why.to_string());
    if (no_file && turn_away(source.socket.fd())) return;
    pollfd wake{wake_, POLLIN, 0};
    poll(&wake, 1, static_cast<int>(kPause.count()));
    return;
  }
  const Connections::Added added = connections_.add(connection);
  if (added != Connections::Added::kYes && tells())
    spdlog::warn(
        "connections {}: {} are open",
        added == Connections::Added::kNo ? "are refused" : "of callers that are not known make room for others",
        connections_.counts(Connections::Clock::now()).open);
  if (added == Connections::Added::kNo) {
    close(connection);
    return;
  }
  const int on = 1;
  (void)setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on,
                   sizeof on);  // fails, and does nothing, for the Unix socket
  source.take(source.socket.fd(), connection);
}

// Where no file can be opened any more, a caller is told so at once, by the descriptor that is kept for this: it would
// wait otherwise, and this thread would be woken for it again and again.
bool Listener::turn_away(int listening) {
  if (spare_ < 0) spare_ = open_spare();  // another thread may have been quicker the last time
  if (spare_ < 0) return false;
  close(spare_);
  const int connection = accept4(listening, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection >= 0) close(connection);
  spare_ = open_spare();
  return connection >= 0;
}

// Whether a message may be logged now; true once a second at most.
bool Listener::tells() {
  const auto now = std::chrono::steady_clock::now();
  if (now - told_ < kToldAgain) return false;
  told_ = now;
  return true;
}

}  // namespace relmap::rpc
