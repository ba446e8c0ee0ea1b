// The process's own memory, as the system sees it.
#pragma once

#include <cstddef>

namespace relmap::ops {

std::size_t resident_bytes();
std::size_t peak_resident_bytes();

// Gives free memory back to the system, where the program's malloc is jemalloc's: by itself it does so only as it is
// used.
void give_back_free_memory();

}  // namespace relmap::ops
