// Checks the size of the socket's receive buffer. Datagrams wait there to be read, and are lost without notice when it
// is full.
#pragma once

#include <string>

namespace relmap {

// Empty if the system grants the receive buffer that the URL asks for (recv_buf_size, which complete_lcm_url() sets).
// Otherwise a message with the size that it grants and the command that raises the limit.
std::string receive_buffer_advice(const std::string& complete_url);

}  // namespace relmap
