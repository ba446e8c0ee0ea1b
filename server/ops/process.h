// The process's own memory, as the system sees it.
#pragma once

#include <cstddef>

namespace relmap {

std::size_t resident_bytes();
std::size_t peak_resident_bytes();

// glibc gives every thread an arena of its own, which keeps what it once held. Two are enough here; call this before
// the first thread starts.
void limit_malloc_arenas();
// Gives free memory at the top of the arenas back to the system.
void trim_malloc();

}  // namespace relmap
