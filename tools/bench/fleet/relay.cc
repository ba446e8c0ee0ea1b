#include "tools/bench/fleet/relay.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <utility>

#include "proto/wire/lcm_url.h"

namespace relmap::bench {

namespace {

constexpr std::size_t kPacketBytes = 1472;  // of a datagram in an Ethernet packet
constexpr int kReceiveBytes = 64 << 20;
constexpr int kAtOnce = 256;  // datagrams of one side before the other has its turn
constexpr double kMinLateMs = 2, kMaxLateMs = 10;

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("relay: " + what + ": " + std::strerror(errno));
}

void bind_to(int socket, std::uint32_t address, std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = address;
  at.sin_port = port;
  if (::bind(socket, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) fail("bind");
}

void set(int socket, int level, int option, int value) { ::setsockopt(socket, level, option, &value, sizeof value); }

}  // namespace

Relay::Side Relay::open(const std::string& url) {
  const std::string network = parse_lcm_url(url).or_throw().network;
  const std::size_t colon = network.find(':');
  Side side;
  side.group = ::inet_addr(network.substr(0, colon).c_str());
  side.port = htons(static_cast<std::uint16_t>(std::stoi(network.substr(colon + 1))));
  side.in = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  side.out = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (side.in < 0 || side.out < 0) fail("socket");
  set(side.in, SOL_SOCKET, SO_REUSEADDR, 1);
  set(side.in, SOL_SOCKET, SO_REUSEPORT, 1);
  set(side.in, SOL_SOCKET, SO_RXQ_OVFL, 1);
  set(side.in, SOL_SOCKET, SO_RCVBUF, kReceiveBytes);
  set(side.in, SOL_SOCKET, SO_RCVBUFFORCE, kReceiveBytes);
  bind_to(side.in, side.group, side.port);
  const ip_mreq membership{{side.group}, {htonl(INADDR_ANY)}};
  if (::setsockopt(side.in, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) fail("join");
  set(side.out, IPPROTO_IP, IP_MULTICAST_TTL, 0);
  bind_to(side.out, htonl(INADDR_ANY), 0);
  sockaddr_in own{};
  socklen_t length = sizeof own;
  if (::getsockname(side.out, reinterpret_cast<sockaddr*>(&own), &length) != 0) fail("getsockname");
  side.own_port = own.sin_port;
  return side;
}

Relay::Relay(const std::string& url_a, const std::string& url_b, std::uint64_t seed)
    : sides_{open(url_a), open(url_b)}, random_(seed), thread_([this] { run(); }) {}

Relay::~Relay() {
  stopping_ = true;
  thread_.join();
  for (const Side& side : sides_) {
    ::close(side.in);
    ::close(side.out);
  }
}

void Relay::begin_faults(const RelayFaults& faults) {
  faults_ = faults;
  datagrams_ = lost_ = late_ = doubled_ = overflowed_ = 0;
  faulty_.store(true, std::memory_order_release);
}

RelayCounts Relay::counts() const { return {datagrams_, lost_, late_, doubled_, overflowed_}; }

void Relay::run() {
  while (!stopping_) {
    pollfd files[2] = {{sides_[0].in, POLLIN, 0}, {sides_[1].in, POLLIN, 0}};
    ::poll(files, 2, held_.empty() ? 50 : 1);
    for (std::size_t side : {0, 1})
      if (files[side].revents != 0) receive(side);
    release_held();
  }
}

void Relay::receive(std::size_t from) {
  Side& side = sides_[from];
  static thread_local std::array<std::uint8_t, 65536> buffer;
  for (int i = 0; i < kAtOnce; ++i) {
    sockaddr_in sender{};
    iovec data{buffer.data(), buffer.size()};
    alignas(cmsghdr) char control[64];
    msghdr message{};
    message.msg_name = &sender;
    message.msg_namelen = sizeof sender;
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    const ssize_t size = ::recvmsg(side.in, &message, 0);
    if (size < 0) return;
    for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
      if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
      std::uint32_t overflowed = 0;
      std::memcpy(&overflowed, CMSG_DATA(c), sizeof overflowed);
      overflowed_ += overflowed - std::exchange(side.overflowed, overflowed);
    }
    if (sender.sin_port != side.own_port) pass(1 - from, buffer.data(), static_cast<std::size_t>(size));
  }
}

void Relay::pass(std::size_t to, const std::uint8_t* bytes, std::size_t size) {
  if (!faulty_.load(std::memory_order_acquire)) return send(to, bytes, size);
  ++datagrams_;
  const double packets = std::ceil(static_cast<double>(size) / kPacketBytes);
  if (!chance(std::pow(1 - faults_.loss, packets))) {
    ++lost_;
    return;
  }
  const bool twice = chance(faults_.doubled);
  doubled_ += twice;
  for (int copy = 0; copy <= twice; ++copy) {
    if (!chance(faults_.late)) {
      send(to, bytes, size);
      continue;
    }
    ++late_;
    const double ms = std::uniform_real_distribution<double>(kMinLateMs, kMaxLateMs)(random_);
    held_.push_back({now_ns() + std::int64_t(1e6 * ms), to, {bytes, bytes + size}});
    std::push_heap(held_.begin(), held_.end(), std::greater<>());
  }
}

void Relay::release_held() {
  while (!held_.empty() && held_.front().due_ns <= now_ns()) {
    std::pop_heap(held_.begin(), held_.end(), std::greater<>());
    send(held_.back().side, held_.back().bytes.data(), held_.back().bytes.size());
    held_.pop_back();
  }
}

void Relay::send(std::size_t to, const std::uint8_t* bytes, std::size_t size) const {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = sides_[to].group;
  at.sin_port = sides_[to].port;
  ::sendto(sides_[to].out, bytes, size, 0, reinterpret_cast<const sockaddr*>(&at), sizeof at);
}

}  // namespace relmap::bench
