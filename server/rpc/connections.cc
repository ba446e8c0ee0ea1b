#include "server/rpc/connections.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <array>
#include <cstring>

#include "proto/base/percent.h"

namespace relmap::rpc {

namespace {

constexpr std::chrono::minutes kTold{1};  // for how long a failure is told

// Device and inode, which no other open file has.
std::pair<dev_t, ino_t> identity_of(int descriptor) {
  struct stat facts {};
  return fstat(descriptor, &facts) == 0 ? std::pair(facts.st_dev, facts.st_ino) : std::pair<dev_t, ino_t>(0, 0);
}

std::string text_of(int family, const void* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  return inet_ntop(family, address, text.data(), text.size()) ? text.data() : "";
}

// What is known of the other side of a connection.
struct Side {
  std::string source;  // its address, or network, without a port; empty for a Unix socket
  std::string peer;    // its address and port
};

Side side_of(int connection) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getpeername(connection, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {"gone", "gone"};
  if (address.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    const std::string text = text_of(AF_INET, &v4.sin_addr);
    return {text, text + " " + std::to_string(ntohs(v4.sin_port))};
  }
  if (address.ss_family != AF_INET6) return {};
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  const std::string port = " " + std::to_string(ntohs(v6.sin6_port));
  if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) {
    const std::string text = text_of(AF_INET, v6.sin6_addr.s6_addr + 12);
    return {text, text + port};
  }
  // Whoever has one address of IPv6 has the /64 around it (RFC 6177), which counts as one source.
  in6_addr network = v6.sin6_addr;
  std::memset(network.s6_addr + 8, 0, 8);
  return {text_of(AF_INET6, &network), text_of(AF_INET6, &v6.sin6_addr) + port};
}

// The same of a peer as gRPC names it: "ipv4:10.0.0.1:5", "ipv6:%5Bfe80::1%25eth0%5D:5". Empty if it is no TCP.
std::string peer_of(const std::string& name) {
  if (!name.starts_with("ipv4:") && !name.starts_with("ipv6:")) return {};
  const auto decoded = percent_decoded(std::string_view(name).substr(5));
  if (!decoded) return {};
  const std::string& text = *decoded;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return {};
  std::string host = text.substr(0, colon);
  if (host.starts_with('[')) host = host.substr(1, host.find_first_of("%]") - 1);  // without the name of an interface
  return host + " " + text.substr(colon + 1);
}

}  // namespace

Connections::Added Connections::add(int connection) {
  Side side = side_of(connection);
  const MutexLock lock(mutex_);
  if (const auto former = open_.find(connection); former != open_.end()) forget(former);
  if (!has_room(side.source)) forget_closed();
  const bool full = !has_room(side.source);
  if (full && !make_room(side.source)) {
    ++refused_;
    return Added::kNo;
  }
  displaced_ += full;
  ++by_source_[side.source];
  if (!side.source.empty()) by_peer_[side.peer] = connection;
  open_.emplace(connection, Open{identity_of(connection), std::move(side.source), std::move(side.peer), Clock::now()});
  return full ? Added::kRoomMade : Added::kYes;
}

bool Connections::has_room(const std::string& source) const {
  const auto local = by_source_.find("");
  const std::size_t sockets = local == by_source_.end() ? 0 : local->second;
  if (source.empty()) return sockets < limits_.total;
  const auto same = by_source_.find(source);
  return open_.size() - sockets < limits_.total && (same == by_source_.end() || same->second < limits_.per_peer);
}

// A stranger's connection makes room: of the same source if that has as many as one may have.
bool Connections::make_room(const std::string& source) {
  if (source.empty()) return false;
  const auto same = by_source_.find(source);
  const bool crowded = same != by_source_.end() && same->second >= limits_.per_peer;
  Entry oldest = open_.end();
  for (Entry it = open_.begin(); it != open_.end(); ++it) {
    const Open& one = it->second;
    if (one.known || one.source.empty() || (crowded && one.source != source)) continue;
    if (oldest == open_.end() || one.since < oldest->second.since) oldest = it;
  }
  if (oldest == open_.end()) return false;
  shut(oldest);
  return true;
}

void Connections::call_begins(const std::string& peer) {
  const std::string key = peer_of(peer);
  if (key.empty()) return;
  const MutexLock lock(mutex_);
  if (Open* const one = find(key)) {
    one->known = true;
    ++one->calls;
    one->since = Clock::now();
  }
}

void Connections::call_ends(const std::string& peer) {
  const std::string key = peer_of(peer);
  if (key.empty()) return;
  const MutexLock lock(mutex_);
  if (Open* const one = find(key); one && one->calls > 0) {
    --one->calls;
    one->since = Clock::now();
  }
}

void Connections::close_quiet(Clock::time_point now) {
  const auto quiet = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limits_.quiet_s));
  const MutexLock lock(mutex_);
  forget_closed();
  for (Entry it = open_.begin(); it != open_.end();) {
    const Open& one = it->second;
    it = !one.source.empty() && one.calls == 0 && one.since + quiet <= now ? shut(it) : std::next(it);
  }
}

void Connections::not_accepted(const Status& why, Clock::time_point now) {
  const MutexLock lock(mutex_);
  not_accepted_ = why;
  not_accepted_at_ = now;
}

ConnectionCounts Connections::counts(Clock::time_point now) const {
  const MutexLock lock(mutex_);
  const bool lately = !not_accepted_.ok() && now - not_accepted_at_ < kTold;
  return {open_.size(), refused_, displaced_, lately ? not_accepted_ : limits_.lowered};
}

// gRPC does not tell when it closes a connection: then its descriptor is closed, or is another file's by now.
void Connections::forget_closed() {
  for (Entry it = open_.begin(); it != open_.end();)
    it = identity_of(it->first) == it->second.file ? std::next(it) : forget(it);
}

Connections::Entry Connections::forget(Entry entry) {
  const Open& one = entry->second;
  if (--by_source_[one.source] == 0) by_source_.erase(one.source);
  if (const auto at = by_peer_.find(one.peer); at != by_peer_.end() && at->second == entry->first) by_peer_.erase(at);
  return open_.erase(entry);
}

// gRPC sees its end, and closes the descriptor. Since only the thread that calls add() opens connections, no other
// connection can have this descriptor after it was looked at.
Connections::Entry Connections::shut(Entry entry) {
  if (identity_of(entry->first) == entry->second.file) ::shutdown(entry->first, SHUT_RDWR);
  return forget(entry);
}

Connections::Open* Connections::find(const std::string& peer) {
  const auto at = by_peer_.find(peer);
  if (at == by_peer_.end()) return nullptr;
  const auto open = open_.find(at->second);
  return open == open_.end() ? nullptr : &open->second;
}

}  // namespace relmap::rpc
