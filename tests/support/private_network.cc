#include "tests/support/private_network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <net/route.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>

namespace relmap::testing {

namespace {

bool write_file(const char* path, const char* text) {
  const int file = ::open(path, O_WRONLY | O_CLOEXEC);
  const bool written = file >= 0 && ::write(file, text, std::strlen(text)) >= 0;
  if (file >= 0) ::close(file);
  return written;
}

// Who is not root owns a network only within a world of users of its own, where it goes by its own number.
bool unshare_network() {
  const unsigned user = ::geteuid(), group = ::getegid();
  if (user == 0) return ::unshare(CLONE_NEWNET) == 0;
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  char map[32];
  std::snprintf(map, sizeof map, "%u %u 1", user, user);
  write_file("/proc/self/uid_map", map);
  write_file("/proc/self/setgroups", "deny");
  std::snprintf(map, sizeof map, "%u %u 1", group, group);
  write_file("/proc/self/gid_map", map);
  return true;
}

sockaddr address(const char* text) {
  sockaddr_in in{};
  in.sin_family = AF_INET;
  ::inet_aton(text, &in.sin_addr);
  sockaddr any;
  std::memcpy(&any, &in, sizeof any);
  return any;
}

}  // namespace

bool enter_private_network(Multicast multicast) {
  if (!unshare_network()) return false;
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq loopback{};
  std::strcpy(loopback.ifr_name, "lo");
  loopback.ifr_flags = IFF_UP | IFF_RUNNING;
  if (multicast == Multicast::kOnLoopback) loopback.ifr_flags |= IFF_MULTICAST;
  bool done = ::ioctl(socket, SIOCSIFFLAGS, &loopback) == 0;
  if (multicast == Multicast::kOnLoopback) {
    rtentry route{};
    route.rt_dst = address("224.0.0.0");
    route.rt_genmask = address("240.0.0.0");
    route.rt_flags = RTF_UP;
    route.rt_dev = loopback.ifr_name;
    done = done && ::ioctl(socket, SIOCADDRT, &route) == 0;
  }
  ::close(socket);
  return done;
}

}  // namespace relmap::testing
