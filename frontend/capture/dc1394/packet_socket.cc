#include "frontend/capture/dc1394/packet_socket.h"

#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace relmap::iidc::dc1394 {

namespace {

Status io_error(const std::string& what) { return {Reason::IO_ERROR, what + ": " + std::strerror(errno)}; }

union Control {
  cmsghdr header;  // aligns it
  char bytes[CMSG_SPACE(sizeof(int))];
};

}  // namespace

Result<std::pair<FileHandle, FileHandle>> socket_pair() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return io_error("no pair of sockets");
  return std::pair(FileHandle(ends[0]), FileHandle(ends[1]));
}

Status send_packet(int socket, std::span<const std::uint8_t> bytes, int file) {
  iovec part{const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  Control control{};
  if (file >= 0) {
    message.msg_control = control.bytes;
    message.msg_controllen = sizeof control.bytes;
    cmsghdr* const header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof file);
    std::memcpy(CMSG_DATA(header), &file, sizeof file);
  }
  ssize_t sent;
  do sent = ::sendmsg(socket, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
  while (sent < 0 && errno == EINTR);
  if (sent < 0) return io_error("a packet cannot be sent");
  return {};
}

Result<Packet> receive_packet(int socket, std::span<std::uint8_t> buffer) {
  iovec part{buffer.data(), buffer.size()};
  Control control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.bytes;
  message.msg_controllen = sizeof control.bytes;
  ssize_t size;
  do size = ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC | MSG_TRUNC);
  while (size < 0 && errno == EINTR);
  if (size < 0) return io_error("no packet can be received");
  if (size == 0) return {Reason::IO_ERROR, "the other end is closed"};
  Packet packet{static_cast<std::size_t>(size), {}};
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header; header = CMSG_NXTHDR(&message, header))
    if (header->cmsg_level == SOL_SOCKET && header->cmsg_type == SCM_RIGHTS &&
        header->cmsg_len == CMSG_LEN(sizeof(int))) {
      int file = -1;
      std::memcpy(&file, CMSG_DATA(header), sizeof file);
      packet.file = FileHandle(file);
    }
  return packet;
}

}  // namespace relmap::iidc::dc1394
