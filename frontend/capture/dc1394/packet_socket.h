// Packets over a Unix SOCK_SEQPACKET socket, optionally with a file descriptor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "frontend/capture/dc1394/file_handle.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Both ends are closed on exec. IO_ERROR if no more files can be opened.
Result<std::pair<FileHandle, FileHandle>> socket_pair();

// Does not block. IO_ERROR if the other end is closed, or its buffer is full.
Status send_packet(int socket, std::span<const std::uint8_t> bytes, int file = -1);

struct Packet {
  std::size_t size = 0;  // as sent; what does not fit into the buffer is lost
  FileHandle file;
};
// Blocks. IO_ERROR if the other end is closed, or this one is shut down.
Result<Packet> receive_packet(int socket, std::span<std::uint8_t> buffer);

}  // namespace relmap::iidc::dc1394
