// A bad network between two multicast groups of this machine: relays datagrams, without knowing their content, and
// loses, delays or doubles some of them.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace relmap::bench {

// Shares of 1,500-byte packets lost, and of datagrams that come late and twice. A datagram of n bytes is ceil(n / 1472)
// packets, and is lost with any of them.
struct RelayFaults {
  double loss = 0, late = 0, doubled = 0;
};

struct RelayCounts {
  std::uint64_t datagrams = 0, lost = 0, late = 0, doubled = 0;
  std::uint64_t overflowed = 0;  // dropped by the kernel before the relay read them, since too much was sent
};

class Relay {
 public:
  // Relays between the groups of two LCM URLs, without faults until begin_faults(). Throws.
  Relay(const std::string& url_a, const std::string& url_b, std::uint64_t seed);
  ~Relay();

  void begin_faults(const RelayFaults& faults);
  // The counts since begin_faults().
  RelayCounts counts() const;

 private:
  struct Side {
    int in = -1, out = -1;
    std::uint32_t group = 0;     // network byte order, as are the ports
    std::uint16_t port = 0;      // of the group
    std::uint16_t own_port = 0;  // that this relay sends from
    std::uint32_t overflowed = 0;
  };
  struct Held {
    std::int64_t due_ns = 0;
    std::size_t side = 0;
    std::vector<std::uint8_t> bytes;
    bool operator>(const Held& other) const { return due_ns > other.due_ns; }
  };

  static Side open(const std::string& url);
  void run();
  void receive(std::size_t from);
  void pass(std::size_t to, const std::uint8_t* bytes, std::size_t size);
  void release_held();
  void send(std::size_t to, const std::uint8_t* bytes, std::size_t size) const;
  bool chance(double share) { return std::uniform_real_distribution<double>(0, 1)(random_) < share; }

  std::array<Side, 2> sides_;
  std::mt19937_64 random_;
  std::vector<Held> held_;  // a heap, what is due first on top
  RelayFaults faults_;      // written before faulty_ is
  std::atomic<bool> faulty_ = false, stopping_ = false;
  std::atomic<std::uint64_t> datagrams_ = 0, lost_ = 0, late_ = 0, doubled_ = 0, overflowed_ = 0;
  std::thread thread_;
};

}  // namespace relmap::bench
