// Datagrams that nobody has read yet wait in the socket's buffer, and are lost in silence when it is full.
#pragma once

#include <string>

namespace relmap {

// Empty if the system grants the receive buffer that the URL (complete_lcm_url()) asks for; else what it grants, and
// the command that raises it.
std::string receive_buffer_advice(const std::string& complete_url);

}  // namespace relmap
