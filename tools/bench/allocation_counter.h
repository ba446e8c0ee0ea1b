// Counts allocations: relmap-bench has a malloc() of its own that counts, and calls glibc's.
#pragma once

#include <cstdint>

namespace relmap::bench {

// The number of allocations by the calling thread since it began.
std::uint64_t allocations();

}  // namespace relmap::bench
