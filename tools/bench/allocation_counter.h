// How often this program has asked for memory: relmap-bench's own malloc() counts and passes on to glibc's.
#pragma once

#include <cstdint>

namespace relmap::bench {

// By the calling thread, since it began.
std::uint64_t allocations();

}  // namespace relmap::bench
