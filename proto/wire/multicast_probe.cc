// Without a multicast route, LCM 1.3.1 opens and receives nothing, or takes ten seconds to fail. This finds out first.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "proto/wire/lcm_link.h"
#include "proto/wire/lcm_url.h"

namespace relmap {

namespace {

constexpr int kTries = 5;
constexpr int kWaitMs = 200;

Status no_route(const std::string& group, const std::string& why) {
  return {Reason::NO_MULTICAST_ROUTE,
          "multicast to " + group + " does not come back (" + why +
              "); as root: ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo"};
}

struct Socket {
  int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ~Socket() {
    if (file >= 0) ::close(file);
  }
};

}  // namespace

Status probe_multicast(const std::string& complete_url) {
  const Result<LcmUrl> url = parse_lcm_url(complete_url);
  if (!url.ok()) return url.status();
  if (url->provider != "udpm") return {};
  std::string group = url->network.substr(0, url->network.find(':'));
  if (group.empty()) group = "239.255.76.67";  // LCM's own default
  in_addr address{};
  if (::inet_aton(group.c_str(), &address) == 0 || (ntohl(address.s_addr) >> 28) != 14)
    return {Reason::INVALID_ARGUMENT, "'" + group + "' is no multicast group"};

  // A port of its own, so that others who listen to the group do not receive the probe.
  const Socket socket;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  socklen_t length = sizeof to;
  if (socket.file < 0 || ::bind(socket.file, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
      ::getsockname(socket.file, reinterpret_cast<sockaddr*>(&to), &length) != 0)
    return {Reason::IO_ERROR, std::string("no UDP socket: ") + std::strerror(errno)};
  to.sin_addr = address;
  const ip_mreq membership{address, {htonl(INADDR_ANY)}};
  if (::setsockopt(socket.file, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0)
    return no_route(group, std::strerror(errno));
  const unsigned char ttl = 0;
  ::setsockopt(socket.file, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);

  const char text[] = "relmap";
  for (int i = 0; i < kTries; ++i) {
    if (::sendto(socket.file, text, sizeof text, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to) < 0)
      return no_route(group, std::strerror(errno));
    pollfd file{socket.file, POLLIN, 0};
    if (::poll(&file, 1, kWaitMs) > 0) return {};
  }
  return no_route(group, "nothing heard");
}

}  // namespace relmap
