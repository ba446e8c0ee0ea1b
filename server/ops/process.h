// Memory of this process as the system sees it.
#pragma once

#include <cstddef>

namespace relmap::ops {

std::size_t resident_bytes();
std::size_t peak_resident_bytes();

// Returns free memory to the system if the program uses jemalloc, which by itself does so only while it is being used.
void give_back_free_memory();

}  // namespace relmap::ops
