// Packets over a Unix SOCK_SEQPACKET socket; a file may come with one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "frontend/capture/dc1394/file_handle.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Both are closed on exec. IO_ERROR: no more files can be opened.
Result<std::pair<FileHandle, FileHandle>> socket_pair();

// Does not wait. IO_ERROR: the other end is closed, or does not read what it has.
Status send_packet(int socket, std::span<const std::uint8_t> bytes, int file = -1);

struct Packet {
  std::size_t size = 0;  // as it was sent: of a longer one than the buffer the rest is lost
  FileHandle file;
};
// Waits. IO_ERROR: the other end is closed, or this one is shut down.
Result<Packet> receive_packet(int socket, std::span<std::uint8_t> buffer);

}  // namespace relmap::iidc::dc1394
