#include "proto/wire/receive_buffer.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>

#include "proto/wire/lcm_url.h"

namespace relmap {

std::string receive_buffer_advice(const std::string& complete_url) {
  const Result<LcmUrl> url = parse_lcm_url(complete_url);
  if (!url.ok() || url->provider != "udpm") return {};
  const int wanted = std::atoi(lcm_option(*url, "recv_buf_size").c_str());
  const int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (file < 0 || wanted <= 0) return {};
  int granted = 0;
  socklen_t length = sizeof granted;
  const bool known = ::setsockopt(file, SOL_SOCKET, SO_RCVBUF, &wanted, sizeof wanted) == 0 &&
                     ::getsockopt(file, SOL_SOCKET, SO_RCVBUF, &granted, &length) == 0;
  ::close(file);
  granted /= 2;  // the kernel reports twice the size, which includes its overhead
  if (!known || granted >= wanted) return {};
  return "the system grants LCM a receive buffer of " + std::to_string(granted) + " bytes of the " +
         std::to_string(wanted) +
         " asked for: keyframes are lost under load, and sent again; as root: sysctl -w "
         "net.core.rmem_max=" +
         std::to_string(wanted);
}

}  // namespace relmap
