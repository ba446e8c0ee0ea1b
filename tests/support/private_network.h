// A private network, for tests that would disturb others or be disturbed by them.
#pragma once

namespace relmap::testing {

enum class Multicast { kNone, kOnLoopback };

// Moves the calling thread, and all that it starts from now on, into a network namespace that has only loopback.
// Without root it must be the only thread. Returns false, without any change, if the system does not allow it.
bool enter_private_network(Multicast multicast);

}  // namespace relmap::testing
