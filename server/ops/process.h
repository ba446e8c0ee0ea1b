// Memory of this process as the system sees it.
#pragma once

#include <cstddef>

namespace relmap::ops {

// Raises the number of files that may be open to what the system allows this process, and returns it.
std::size_t raise_file_limit();

std::size_t resident_bytes();
std::size_t peak_resident_bytes();

double cpu_seconds();  // of user and system, since the start
std::size_t open_files();
std::size_t max_files();

// What the allocator's pages in use hold beyond what was asked for: holes between what is in use. 0 without jemalloc.
std::size_t allocator_holes_bytes();

// Returns free memory to the system if the program uses jemalloc, which by itself does so only while it is being used.
void give_back_free_memory();

}  // namespace relmap::ops
