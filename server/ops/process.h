// The process's own memory, as the system sees it.
#pragma once

#include <cstddef>

namespace relmap {

std::size_t resident_bytes();
std::size_t peak_resident_bytes();

}  // namespace relmap
