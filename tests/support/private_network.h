// A network that nobody else is in: for what would disturb others, or be disturbed by them.
#pragma once

namespace relmap::testing {

enum class Multicast { kNone, kOnLoopback };

// Moves the calling thread, and what it starts from now on, into a network namespace with nothing but loopback. Who is
// not root needs to be the only thread. False: the system does not allow it, and nothing has changed.
bool enter_private_network(Multicast multicast);

}  // namespace relmap::testing
